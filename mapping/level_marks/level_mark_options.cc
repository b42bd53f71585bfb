#include "mapping/level_marks/level_mark_options.h"

#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kTable{Option{"find", &LevelMarkOptions::find, false, true},
                             Option{"max_off_m", &LevelMarkOptions::max_off_m, 0.001, 0.2},
                             Option{"beside_m", &LevelMarkOptions::beside_m, 0.05, 1.0},
                             Option{"height_m", &LevelMarkOptions::height_m, 0.25, 3.0},
                             Option{"max_standing", &LevelMarkOptions::max_standing, 0.0, 1.0},
                             Option{"min_flat", &LevelMarkOptions::min_flat, 0.01, 1.0},
                             Option{"min_share", &LevelMarkOptions::min_share, 0.01, 1.0}};

}  // namespace

void LevelMarkOptions::Check() const { kTable.Check("mapping.level_marks", *this); }
void LevelMarkOptions::Read(YamlSection section) { kTable.Read(section, this); }

}  // namespace slcmap
