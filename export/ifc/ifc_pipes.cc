#include "export/ifc/ifc_pipes.h"

#include <spdlog/fmt/fmt.h>

#include "export/pipe_tubes.h"
#include "export/storey_at.h"

namespace slcmap {
namespace {

constexpr double kLeastPipe_m = 1e-4;

void AddPipe(const MapPipe& pipe, IfcPart* part, IfcFile* file) {
  const Eigen::Vector3d floor = part->floor_m * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d start = pipe.start_world - floor, end = pipe.end_world - floor;
  const std::string solid = file->RoundBar(start, end, pipe.radius_m);
  file->SetSurface(solid, kPipeColour, 0);
  const std::string content = fmt::format("{} pipe {}", part->content, pipe.id);
  const std::string element =
      file->AddRooted("IFCPIPESEGMENT", content,
                      {StepText(fmt::format("Pipe {}", pipe.id)), kStepUnset, kStepUnset,
                       file->LocalPlacement(part->placement, {}), file->SolidShape({solid}),
                       StepText(fmt::format("{}", pipe.id)), ".NOTDEFINED."});
  part->elements.push_back(element);
  file->AddProperties(element, content, "Pipe",
                      {{"radius_m", IfcLengthValue(pipe.radius_m)},
                       {"radius_sigma_m", IfcLengthValue(pipe.radius_sigma_m)},
                       {"sigma_m", IfcLengthValue(pipe.sigma_m)},
                       {"images", IfcIntegerValue(pipe.images)}});
}

}  // namespace

int AddIfcPipes(const MapResult& map, IfcStructure* structure, IfcFile* file) {
  int left_out = 0;
  for (const MapPipe& pipe : map.pipes) {
    if ((pipe.end_world - pipe.start_world).norm() < kLeastPipe_m) {
      ++left_out;
      continue;
    }
    const double middle_m = 0.5 * (pipe.start_world.z() + pipe.end_world.z());
    AddPipe(pipe, &structure->GetPart(StoreyAt(map.building, middle_m)), file);
  }
  return left_out;
}

}  // namespace slcmap
