#include "apps/start_check.h"

#include <gtest/gtest.h>

namespace slcmap {

bool Interrupted() { return false; }  // main.cc's, where there are signals

namespace {

CheckReport FoundBoth() {
  CheckReport report;
  report.corrections = {{kTimeOffsetCorrection, {-0.02}, "time offset -20 ms"},
                        {kRightTurnCorrection, {0, 0.003, 0}, "right camera's turn"}};
  return report;
}

TEST(StartCheck, WhatOptionsHoldStaysAsItWasCalibrated) {
  CheckReport report = FoundBoth();
  LeaveOutHeld({}, &report);
  EXPECT_EQ(report.corrections.size(), 2u);
  CalibrationOptions held;
  held.time_offset = false;
  LeaveOutHeld(held, &report);
  ASSERT_EQ(report.corrections.size(), 1u);
  EXPECT_EQ(report.corrections[0].name, kRightTurnCorrection);
  held.right_rotation = false;
  LeaveOutHeld(held, &report);
  EXPECT_TRUE(report.corrections.empty());
}

}  // namespace
}  // namespace slcmap
