// Where the maps of several folders lie to each other, as commands ask for it.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/align/map_changes.h"
#include "mapping/align/place_maps.h"
#include "mapping/mapping.h"

namespace slcmap::inline commands {

struct MapFolder {
  std::string path;
  std::string name;         // in messages
  std::string storey = {};  // as MapToPlace has it
  std::string date = {};    // YYYY-MM-DD; "": not said
};

// What changed between two maps that lie together, whose dates differ. Places are in the world of
// the first map of their group.
struct DatedChange {
  std::size_t group = 0;
  std::string after, by;  // it was before the change on one day, and after it on the other
  MapChange change;
};

struct PlacedFolders {
  MapPlacement placement;
  std::vector<DatedChange> changes;  // by date, the largest first
};

// Places them by their indexes and by what pairs of them have in common; a few maps are held at
// once. What aligning two maps gave is kept in the file `kept`, if it is not "". Maps that cannot
// be merged, or with a run that is in one before, stay apart for that reason.
PlacedFolders PlaceFolders(const std::vector<MapFolder>& folders, bool accept_changed,
                           const std::string& kept, const Progress& progress);

// placement.json: `placed` says of each map, and of the run that it begins with, where it lies, by
// group. Throws OutputError.
void WritePlacement(const std::string& path, const std::vector<MapFolder>& folders,
                    const PlacedFolders& placed);

struct FolderPlace {
  std::size_t group = 0;
  RigidTransform T_group_map;
  std::string date;
};

// Of the map of a name, or of that which a folder's map begins with. Throws DataError where the
// file has none. Recordings of one run have names of their own.
FolderPlace FindPlaceOfName(const std::string& placement, const std::string& name);
FolderPlace FindPlaceOfFolder(const std::string& placement, const std::string& folder);

}  // namespace slcmap::commands
