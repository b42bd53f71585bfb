#include "export/ifc/ifc_structure.h"

#include <spdlog/fmt/fmt.h>

namespace slcmap {

IfcStructure::IfcStructure(const MapResult& map, IfcFile* file) : file_(file) {
  const std::string& content = map.source.run_id;
  const std::string contexts = StepList({file_->contexts().model});
  const std::string project =
      file_->AddRooted("IFCPROJECT", content,
                       {StepText("map " + map.id), StepText("Measured by slcmap"), kStepUnset,
                        kStepUnset, kStepUnset, contexts, file_->units()});
  const std::string of_site = file_->LocalPlacement(kStepUnset, {});
  const std::string site =
      file_->AddRooted("IFCSITE", content,
                       {"'Site'", kStepUnset, kStepUnset, of_site, kStepUnset, kStepUnset,
                        ".ELEMENT.", kStepUnset, kStepUnset, kStepUnset, kStepUnset, kStepUnset});
  building_.content = content;
  // Heights of storeys are over the lowest floor; the map's z counts from where odometry began.
  if (!map.building.storeys.empty()) building_.floor_m = map.building.storeys.front().floor_m;
  building_.placement = file_->LocalPlacement(of_site, {.origin = {0, 0, building_.floor_m}});
  building_.entity =
      file_->AddRooted("IFCBUILDING", content,
                       {"'Building'", kStepUnset, kStepUnset, building_.placement, kStepUnset,
                        kStepUnset, ".ELEMENT.", kStepUnset, kStepUnset, kStepUnset});
  Aggregate(project, "project " + content, {site});
  Aggregate(site, "site " + content, {building_.entity});
  AddStoreys(map);
}

void IfcStructure::AddStoreys(const MapResult& map) {
  std::vector<std::string> entities;
  for (const Storey& storey : map.building.storeys) {
    IfcPart part;
    part.floor_m = storey.floor_m;
    part.content = fmt::format("{} storey {}", map.source.run_id, storey.id);
    const double elevation_m = storey.floor_m - building_.floor_m;
    part.placement = file_->LocalPlacement(building_.placement, {.origin = {0, 0, elevation_m}});
    part.entity = file_->AddRooted(
        "IFCBUILDINGSTOREY", part.content,
        {StepText(fmt::format("Storey {}", storey.id)), kStepUnset, kStepUnset, part.placement,
         kStepUnset, kStepUnset, ".ELEMENT.", StepReal(elevation_m)});
    entities.push_back(part.entity);
    storeys_.push_back(part);
  }
  if (!entities.empty()) Aggregate(building_.entity, building_.content, entities);
}

IfcPart& IfcStructure::GetPart(std::optional<std::size_t> storey) {
  return storey ? storeys_[*storey] : building_;
}

void IfcStructure::Aggregate(const std::string& whole, const std::string& content,
                             const std::vector<std::string>& parts) {
  file_->AddRooted("IFCRELAGGREGATES", content, {kStepUnset, kStepUnset, whole, StepList(parts)});
}

void IfcStructure::Finish() {
  std::vector<IfcPart*> all = {&building_};
  for (IfcPart& storey : storeys_) all.push_back(&storey);
  for (IfcPart* part : all) {
    if (!part->spaces.empty()) Aggregate(part->entity, part->content + " spaces", part->spaces);
    if (part->elements.empty()) continue;
    file_->AddRooted("IFCRELCONTAINEDINSPATIALSTRUCTURE", part->content,
                     {kStepUnset, kStepUnset, StepList(part->elements), part->entity});
  }
}

}  // namespace slcmap
