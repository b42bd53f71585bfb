// Lines by where they are.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "mapping/lines/line_store.h"

namespace slcmap {

// Lines by the cells of half a metre that their intervals pass.
class LineCells {
 public:
  // The lines must outlive it.
  explicit LineCells(const std::vector<TrackedLine>& lines) : lines_(lines) {}

  void Add(int line);

  // Those of the added lines that pass a line's cells or their neighbours: all that are up to half
  // a metre from it. In order, each once.
  std::vector<int> Near(int line) const;

 private:
  using Cell = std::array<int64_t, 3>;
  struct CellHash {
    size_t operator()(const Cell& cell) const;
  };
  std::vector<Cell> CellsOf(int line) const;
  std::vector<Cell> CellsAround(int line) const;  // and their neighbours, each once

  const std::vector<TrackedLine>& lines_;
  std::unordered_map<Cell, std::vector<int>, CellHash> members_;
};

}  // namespace slcmap
