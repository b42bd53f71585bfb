// The rows of a file of poses, before the unit of their stamps is known.
#pragma once

#include <string>
#include <vector>

#include "data/io/pose_file.h"

namespace slcmap::inline data {

struct RowText {
  int row = 0;
  std::string stamp;
  PoseRow pose;
  bool is_lost = false;  // without numbers: it counts as a row, and is no pose
};

struct FileText {
  std::vector<RowText> rows;
  bool has_stamps = true;
  bool is_colmap = false;
  size_t matrix_columns = 0;
  int form_shift = 9;  // of the stamps, as the form of the file has them
  PoseTable table;
};

// The rows of any form of file, in their order. Throws DataError naming the row.
FileText ReadPoseRows(const std::string& path);

}  // namespace slcmap::data
