// What the parts of the Python module share. Names in it, shapes and units are told to Python's
// users in slcmap/_slcmap.pyi.
#pragma once

#include <pybind11/pybind11.h>

namespace slcmap::inline python {

namespace py = pybind11;

// Each adds its classes and functions to the module.
void AddErrors(py::module_& module);
void AddTypes(py::module_& module);
void AddRecording(py::module_& module);
void AddOdometry(py::module_& module);
void AddMap(py::module_& module);
void AddCommand(py::module_& module);

// From now on what slcmap logs waits for ForwardLog(), as threads without Python's lock log too.
void KeepLog();

// Hands what was logged to Python's logger "slcmap", and takes over from it whether details are to
// be logged. Called with Python's lock held; what a handler throws is reported, not thrown.
void ForwardLog() noexcept;

// Does what takes long, or logs, without Python's lock.
template <typename Work>
auto WithoutLock(Work work) {
  struct Forward {
    ~Forward() { ForwardLog(); }
  };
  const Forward behind_it;
  const py::gil_scoped_release unlocked;
  return work();
}

}  // namespace slcmap::python
