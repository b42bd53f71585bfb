#include "apps/comparison/spread.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

bool IsBetter(const Ranked& a, const Ranked& b, bool less_is_better) {
  return less_is_better ? IsBelow(a.spread, b.spread) : IsBelow(b.spread, a.spread);
}

std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace

Spread SpreadOf(const std::vector<double>& values) {
  Spread spread;
  spread.count = static_cast<int>(values.size());
  if (values.empty()) return spread;
  for (const double value : values) spread.mean += value / spread.count;
  if (values.size() < 2) return spread;
  double squares = 0;
  for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(squares / (spread.count - 1));
  return spread;
}

std::string SpreadText(const Spread& spread, int digits) {
  if (spread.count == 0) return "-";
  if (spread.count == 1) return fmt::format("{:.{}f}", spread.mean, digits);
  return fmt::format("{:.{}f} +- {:.{}f}", spread.mean, digits, spread.deviation, digits);
}

bool IsBelow(const Spread& a, const Spread& b) {
  if (a.count < 2 || b.count < 2) return false;
  const double error =
      std::sqrt(a.deviation * a.deviation / a.count + b.deviation * b.deviation / b.count);
  return b.mean - a.mean > 2 * error && b.mean > a.mean;
}

std::optional<size_t> BestOf(const std::vector<Ranked>& methods, bool less_is_better) {
  if (methods.size() < 2) return std::nullopt;
  for (size_t i = 0; i < methods.size(); ++i) {
    bool best = true;
    for (size_t j = 0; j < methods.size(); ++j) {
      best = best && (i == j || IsBetter(methods[i], methods[j], less_is_better));
    }
    if (best) return i;
  }
  return std::nullopt;
}

std::string OrderInWords(const std::vector<Ranked>& methods, bool less_is_better) {
  const auto is_single = [](const Ranked& m) { return m.spread.count < 2; };
  if (methods.size() < 2) return "nothing to compare with";
  if (std::count_if(methods.begin(), methods.end(), is_single) + 1 >=
      static_cast<std::ptrdiff_t>(methods.size())) {
    return "single runs: nothing says how far they scatter, so no order";
  }
  std::vector<Ranked> sorted = methods;
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Ranked& a, const Ranked& b) {
    return less_is_better ? a.spread.mean < b.spread.mean : b.spread.mean < a.spread.mean;
  });
  std::vector<std::string> parts;
  for (const Ranked& better : sorted) {
    std::vector<std::string> worse;
    for (const Ranked& other : sorted) {
      if (IsBetter(better, other, less_is_better)) worse.push_back(other.name);
    }
    if (!worse.empty()) parts.push_back(better.name + " before " + Listed(worse));
  }
  return parts.empty() ? "the spread bears no order" : fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace slcmap
