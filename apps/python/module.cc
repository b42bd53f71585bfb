// The Python module slcmap._slcmap: its errors and its log.
#include "apps/python/module.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <mutex>
#include <opencv2/core.hpp>
#include <vector>

#include "apps/commands/odometry_stage.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/version.h"

namespace slcmap::inline python {
namespace {

struct LogMessage {
  spdlog::level::level_enum level;
  std::string text;
};

// Keeps messages until they are taken, from any thread.
class KeepingSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::vector<LogMessage> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(messages_, {});
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    messages_.push_back({message.level, {message.payload.data(), message.payload.size()}});
  }
  void flush_() override {}

 private:
  std::vector<LogMessage> messages_;
};

KeepingSink& Log() {
  static const auto sink = std::make_shared<KeepingSink>();
  static const bool is_set = [] {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("slcmap", sink));
    return true;
  }();
  (void)is_set;
  return *sink;
}

// The numbers of Python's logging.
int PythonLevel(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return 40;
  if (level == spdlog::level::warn) return 30;
  return level == spdlog::level::info ? 20 : 10;
}

// Errors of Python's that stand for those of C++; they live as long as the process.
struct Errors {
  py::handle data, config, output, failed_run;
};

Errors& PythonErrors() {
  static Errors errors;
  return errors;
}

py::handle NewError(py::module_& module, const char* name, py::handle base, const char* words) {
  const std::string full_name = std::string("slcmap.") + name;
  const py::handle error = PyErr_NewExceptionWithDoc(full_name.c_str(), words, base.ptr(), nullptr);
  module.attr(name) = error;
  return error;
}

void Raise(py::handle error, const std::string& message) {
  PyErr_SetString(error.ptr(), message.c_str());
}

void Translate(std::exception_ptr thrown) {
  const Errors& errors = PythonErrors();
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const InputFault& error) {
    Raise(errors.data, error.what() + ("; remedy: " + error.remedy()));
  } catch (const DataError& error) {
    Raise(errors.data, error.what());
  } catch (const ConfigError& error) {
    Raise(errors.config, error.what());
  } catch (const OutputError& error) {
    Raise(errors.output, error.what());
  } catch (const FailedRunError& error) {
    Raise(errors.failed_run, error.what());
  } catch (const StoppedError& error) {
    Raise(PyExc_KeyboardInterrupt, error.what());
  } catch (const cv::Exception& error) {
    Raise(errors.data, "images that could not be worked on (" + error.func + ": " + error.err +
                           "); slcmap.check says what is wrong with them");
  }
}

}  // namespace

void KeepLog() { Log(); }

void ForwardLog() noexcept {
  const std::vector<LogMessage> messages = Log().Take();
  if (messages.empty()) return;
  py::error_scope error_that_is_on_its_way;
  try {
    const py::object logger = py::module_::import("logging").attr("getLogger")("slcmap");
    for (const LogMessage& message : messages) {
      logger.attr("log")(PythonLevel(message.level), "%s", message.text);
    }
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable("slcmap's log");
  } catch (const std::exception&) {  // no memory for the message, or no UTF-8 in it
  }
}

void AddErrors(py::module_& module) {
  Errors& errors = PythonErrors();
  errors.data = NewError(module, "DataError", PyExc_ValueError,
                         "Input that cannot be used: what was found, and what was expected.");
  errors.config = NewError(module, "ConfigError", PyExc_ValueError, "A wrong option or argument.");
  errors.output =
      NewError(module, "OutputError", PyExc_OSError, "Output that could not be written.");
  errors.failed_run =
      NewError(module, "FailedRunError", errors.data,
               "A run that is done and written, and by its own verdict not to be believed.");
  py::register_local_exception_translator(&Translate);
}

}  // namespace slcmap::python

PYBIND11_MODULE(_slcmap, module) {
  using namespace slcmap;
  module.doc() = "What slcmap does in C++; use it by `import slcmap`.";
  module.attr("__version__") = kVersion;
  KeepLog();
  AddErrors(module);
  AddTypes(module);
  AddRecording(module);
  AddOdometry(module);
  AddMap(module);
  AddCommand(module);
  // Users know the package alone.
  for (const auto& [name, value] : module.attr("__dict__").cast<pybind11::dict>()) {
    if (PyType_Check(value.ptr())) pybind11::setattr(value, "__module__", pybind11::str("slcmap"));
  }
}
