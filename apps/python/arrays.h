// numpy's arrays over what C++ holds, and the other way round.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <type_traits>
#include <vector>

#include "apps/python/module.h"
#include "data/io/trajectory.h"

namespace slcmap::inline python {

// A trajectory as a class of Python's.
struct PyTrajectory {
  Trajectory poses;
};

// A member of all rows, without a copy: n values, or n x the size of a vector, or n x `columns`
// numbers that lie side by side from that vector on. Read-only; `owner` keeps the rows.
template <typename Row, typename Member>
py::array Column(const std::vector<Row>& rows, Member member, py::handle owner, int columns = 0) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Member, const Row&>>;
  const void* data = rows.empty() ? nullptr : &std::invoke(member, rows.front());
  std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(rows.size())};
  std::vector<py::ssize_t> strides = {sizeof(Row)};
  py::dtype type;
  if constexpr (std::is_arithmetic_v<Value>) {
    type = py::dtype::of<Value>();
  } else {
    type = py::dtype::of<typename Value::Scalar>();
    shape.push_back(columns > 0 ? columns : py::ssize_t{Value::RowsAtCompileTime});
    strides.push_back(sizeof(typename Value::Scalar));
  }
  py::array array(type, shape, strides, data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

// n x N of vectors with N numbers.
template <int N>
py::array_t<double> ToArray(const std::vector<Eigen::Matrix<double, N, 1>>& rows) {
  py::array_t<double> array({static_cast<py::ssize_t>(rows.size()), py::ssize_t{N}});
  double* to = array.mutable_data();
  for (const auto& row : rows) to = std::copy(row.data(), row.data() + N, to);
  return array;
}

// rows x columns of uint8, without a copy; None of an empty image.
inline py::object ToArray(const cv::Mat& image) {
  if (image.empty()) return py::none();
  auto kept = std::make_unique<cv::Mat>(image);
  const py::capsule owner(kept.get(), [](void* mat) { delete static_cast<cv::Mat*>(mat); });
  const cv::Mat& mat = *kept.release();
  return py::array_t<uint8_t>({mat.rows, mat.cols},
                              {static_cast<py::ssize_t>(mat.step[0]), py::ssize_t{1}}, mat.data,
                              owner);
}

}  // namespace slcmap::python
