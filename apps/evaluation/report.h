// What reports are made of: figures, also of nothing.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "data/core/math.h"

namespace slcmap::inline evaluation {

// Files that were compared, as the user named them; they stand at the head of tables and JSON.
struct ComparedFiles {
  std::string truth, mapped;
};

// Not a number; null in JSON.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

// A part of a whole; of none, no figure.
inline double ComputeShare(double part, double whole) {
  return whole > 0 ? part / whole : kNoFigure;
}
inline double ComputeShare(int64_t part, int64_t whole) {
  return ComputeShare(static_cast<double>(part), static_cast<double>(whole));
}

// The value below which a share of others lies; of none, no figure.
inline double QuantileFigure(std::vector<double> values, double share) {
  return values.empty() ? kNoFigure : Quantile(std::move(values), share);
}

// For tables: "-" where there is none.
inline std::string FigureText(double figure, int digits) {
  return std::isnan(figure) ? "-" : fmt::format("{:.{}f}", figure, digits);
}

// Figures to read, by the names that they have in JSON.
std::string FiguresText(const nlohmann::ordered_json& figures);

}  // namespace slcmap::evaluation
