// Maps for programs of drawing, of building information modelling and of modelling: DXF, IFC, OBJ.
#pragma once

#include <Eigen/Core>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "export/plan/dimensions.h"
#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

enum class DxfLinetype { kContinuous, kDashed, kDotted };

struct DxfLayer {
  std::string name;
  int colour = 7;  // of AutoCAD's index: 1 red, 3 green, 5 blue, 7 black or white, ...
  DxfLinetype linetype = DxfLinetype::kContinuous;
  bool is_on = true;
};

// A DXF file in the form of AutoCAD R12, the one that all programs read.
//
// Metres. Names are upper-case ASCII letters, digits, $, _ and -, at most 31 of them. Texts are
// ASCII: what is not, is written by its nearest ASCII characters.
class DxfFile {
 public:
  // Texts and dashes are sized for a drawing that is printed at 1 : scale.
  explicit DxfFile(int scale) : scale_(scale), sizes_(scale) {}

  const PlanTextSizes& sizes() const { return sizes_; }

  // What is drawn on a layer comes after it was added. Layers on which nothing is drawn are left
  // out of the file.
  void AddLayer(const DxfLayer& layer) { layers_.push_back(layer); }

  void AddLine(const std::string& layer, const Eigen::Vector3d& start, const Eigen::Vector3d& end);
  void AddPoint(const std::string& layer, const Eigen::Vector3d& point);
  void AddTriangle(const std::string& layer, const std::array<Eigen::Vector3d, 3>& corners);
  void AddPolyline(const std::string& layer, const std::vector<Eigen::Vector3d>& points,
                   bool is_closed);
  void AddText(const std::string& layer, const DrawnText& text);
  // The dimension with the block that shows it, at z = 0.
  void AddDimension(const std::string& layer, const Dimension& dimension);

  // Said at the head of the file; "" for nothing.
  void SetComment(const std::string& comment) { comment_ = comment; }

  std::string Text() const;

 private:
  std::string Header() const;
  std::string Tables() const;
  std::vector<DxfLayer> UsedLayers() const;
  void Extend(const Eigen::Vector3d& point);

  const int scale_;
  PlanTextSizes sizes_;
  std::string comment_;
  std::vector<DxfLayer> layers_;
  std::set<std::string> used_;
  std::string blocks_, entities_;
  int dimensions_ = 0;
  bool is_empty_ = true;
  Eigen::Vector3d least_ = Eigen::Vector3d::Zero(), most_ = Eigen::Vector3d::Zero();
};

// A text with ASCII characters alone.
std::string Ascii(const std::string& text);

// Maps for CAD programs.

// Writes plan.dxf, the plans of all storeys at z = 0 (those above the lowest on layers that are
// off; where there are several, each is in plan/storey_N.dxf by itself too), sections and
// elevations as plan/NAME.dxf, upright in x and y, and map.dxf, the map in space: lines by storey,
// axis and kind, points, planes, trajectory. All in metres, in the frame of Building::T_map_world.
class DxfWriter : public MapWriter {
 public:
  DxfWriter(const PlanOptions& options, double max_jump_s)
      : options_(options), max_jump_s_(max_jump_s) {}
  std::string Format() const override { return "dxf"; }
  std::vector<std::string> Names() const override { return {"plan.dxf", "map.dxf", "plan"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  PlanOptions options_;
  double max_jump_s_;
};

// IFC4, for programs of building information modelling.

// Writes map.ifc: project, site, building, storeys; walls with openings and doors, slabs, spaces,
// pipes, and lines as annotations. Metres, in the map's world; without a compass there is no true
// north. What cannot be a solid is left out, with a warning that counts it.
class IfcWriter : public MapWriter {
 public:
  explicit IfcWriter(const IfcOptions& options) : options_(options) {}
  std::string Format() const override { return "ifc"; }
  std::vector<std::string> Names() const override { return {"map.ifc"}; }

  // Throws also DataError for a map with numbers that are not finite, and ConfigError for options
  // out of their range.
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  IfcOptions options_;
};

// Writes map.obj, in metres, z or y up: an object (`o`) a layer of map_layers.h, lines, outlines
// and the trajectory as line elements (`l`) of two vertices each, planes as triangles (`f`); and
// map.mtl with a colour for each kind of plane, axis of lines and the trajectory.
class ObjWriter : public MapWriter {
 public:
  explicit ObjWriter(double max_jump_s, const ObjOptions& options = {})
      : max_jump_s_(max_jump_s), options_(options) {}
  std::string Format() const override { return "obj"; }
  std::vector<std::string> Names() const override { return {"map.obj", "map.mtl"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  double max_jump_s_;
  ObjOptions options_;
};

}  // namespace slcmap::exporting
