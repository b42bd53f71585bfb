#include "mapping/dense/dense_file.h"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "data/file_writer.h"
#include "odometry/run_rows.h"

namespace slcmap {
namespace {

template <typename T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void WriteDensePly(const std::string& path, const std::vector<DensePoint>& points, PlyForm form,
                   const std::string& comment) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "sigma_m"}) {
    vertices.Add(name, PlyType::kFloat);
  }
  // Viewers colour a cloud by red, green and blue alone.
  for (const char* name : {"red", "green", "blue", "grey"}) vertices.Add(name, PlyType::kUint8);
  vertices.Add("source", PlyType::kInt32);
  vertices.Reserve(points.size());
  for (const DensePoint& point : points) {
    const Eigen::Vector3d &p = point.p_world, &n = point.normal_world;
    const double grey = point.grey;
    vertices.AppendRow({p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), point.sigma_m, grey, grey, grey,
                        grey, static_cast<double>(point.source)});
  }
  PlyFile file{{"slcmap dense points, metres in the world frame"}, {}, {}};
  if (!comment.empty()) file.comments.push_back(comment);
  file.elements.push_back(std::move(vertices));  // a list of elements would copy it
  WritePly(path, file, form);
}

std::vector<DensePoint> ReadDensePly(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const auto bounded = [&](const char* name, double least, double most) {
    return vertices.Bounded(name, least, most, path);
  };
  const auto coordinate = [&](const char* name) {
    return bounded(name, -kMaxCoordinate_m, kMaxCoordinate_m);
  };
  const std::vector<double> x = coordinate("x"), y = coordinate("y"), z = coordinate("z");
  const std::vector<double> nx = bounded("nx", -1, 1), ny = bounded("ny", -1, 1),
                            nz = bounded("nz", -1, 1);
  const std::vector<double> sigma_m = bounded("sigma_m", 0, kMaxSigma_m);
  const std::vector<double> grey = bounded("grey", 0, 255), source = bounded("source", 0, 1);
  std::vector<DensePoint> points(vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = {{x[i], y[i], z[i]},
                 {nx[i], ny[i], nz[i]},
                 sigma_m[i],
                 static_cast<uint8_t>(grey[i]),
                 source[i] == 1 ? DenseSource::kFilledPlane : DenseSource::kStereo};
  }
  return points;
}

void WriteDensePcd(const std::string& path, const std::vector<DensePoint>& points) {
  std::string bytes = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS x y z normal_x normal_y normal_z intensity sigma_m source\n"
      "SIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F F F F F F I\nCOUNT 1 1 1 1 1 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  FileWriter file(path);
  for (const DensePoint& point : points) {
    for (const double value : point.p_world) Append(static_cast<float>(value), &bytes);
    for (const double value : point.normal_world) Append(static_cast<float>(value), &bytes);
    Append(static_cast<float>(point.grey), &bytes);
    Append(static_cast<float>(point.sigma_m), &bytes);
    Append(static_cast<int32_t>(point.source), &bytes);
    file.Add(bytes);
    bytes.clear();
  }
  file.Add(bytes);
  file.Close();
}

}  // namespace slcmap
