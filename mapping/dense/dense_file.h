// The dense cloud on disk.
#pragma once

#include <string>
#include <vector>

#include "data/ply.h"
#include "mapping/dense/dense_point.h"

namespace slcmap {

// A PLY file: `x y z nx ny nz sigma_m` (float), `red green blue grey` (uchar, all four the grey of
// the image) and `source` (int: 0 stereo, 1 filled plane), with a comment where there is one.
// Throws OutputError.
void WriteDensePly(const std::string& path, const std::vector<DensePoint>& points,
                   PlyForm form = PlyForm::kBinary, const std::string& comment = "");

// Reads what WriteDensePly wrote. Throws DataError naming file and row.
std::vector<DensePoint> ReadDensePly(const std::string& path);

// The same as a PCD file, with `normal_x normal_y normal_z` and `intensity` as PCL names them.
void WriteDensePcd(const std::string& path, const std::vector<DensePoint>& points);

}  // namespace slcmap
