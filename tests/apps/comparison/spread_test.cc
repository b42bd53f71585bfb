#include <gtest/gtest.h>

#include "apps/compare/figures.h"

namespace slcmap {
namespace {

Ranked Of(const std::string& name, const std::vector<double>& values) {
  return {name, ComputeSpread(values)};
}

TEST(Spread, IsMeanAndStandardDeviation) {
  const Spread spread = ComputeSpread({1, 2, 3});
  EXPECT_EQ(spread.count, 3);
  EXPECT_DOUBLE_EQ(spread.mean, 2);
  EXPECT_DOUBLE_EQ(spread.deviation, 1);
  EXPECT_EQ(SpreadText(spread, 1), "2.0 +- 1.0");
  EXPECT_EQ(SpreadText(ComputeSpread({4}), 2), "4.00");
  EXPECT_EQ(SpreadText(ComputeSpread({}), 2), "-");
}

TEST(Spread, NothingIsRankedThatTheSpreadDoesNotBear) {
  const Ranked a = Of("a", {1.0, 1.1, 0.9}), b = Of("b", {2.0, 2.1, 1.9}),
               wide = Of("wide", {0.5, 1.6, 2.7}), single = Of("single", {0.1});
  EXPECT_TRUE(IsBelow(a.spread, b.spread));
  EXPECT_FALSE(IsBelow(b.spread, a.spread));
  EXPECT_FALSE(IsBelow(a.spread, wide.spread));
  EXPECT_FALSE(IsBelow(single.spread, b.spread));
  EXPECT_EQ(FindBestMethod({b, a}, true), 1u);
  EXPECT_EQ(FindBestMethod({b, a}, false), 0u);
  EXPECT_FALSE(FindBestMethod({a, b, wide}, true));
  EXPECT_FALSE(FindBestMethod({a, b, single}, true));
  EXPECT_FALSE(FindBestMethod({a}, true));
}

TEST(Spread, OrderIsToldInWords) {
  const Ranked a = Of("a", {1.0, 1.1, 0.9}), b = Of("b", {2.0, 2.1, 1.9}),
               wide = Of("wide", {0.5, 1.6, 2.7});
  EXPECT_EQ(OrderInWords({b, a, wide}, true), "a before b");
  EXPECT_EQ(OrderInWords({b, a}, false), "b before a");
  EXPECT_EQ(OrderInWords({a, wide}, true), "the spread bears no order");
  EXPECT_EQ(OrderInWords({Of("a", {1}), Of("b", {2})}, true),
            "single runs: nothing says how far they scatter, so no order");
}

TEST(Spread, TheSameTwiceIsNotRanked) {
  EXPECT_FALSE(FindBestMethod({Of("a", {1, 1}), Of("b", {1, 1})}, true));
  EXPECT_EQ(FindBestMethod({Of("a", {1, 1}), Of("b", {1.5, 1.5})}, true), 0u);
}

}  // namespace
}  // namespace slcmap
