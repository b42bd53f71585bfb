#include <gtest/gtest.h>

#include "apps/commands/check.h"

namespace slcmap::inline commands {

bool Interrupted() { return false; }  // main.cc's, where there are signals

}  // namespace slcmap::commands

namespace slcmap {

namespace {

CheckReport FoundAll() {
  CheckReport report;
  report.corrections = {{kTimeOffsetCorrection, {-0.02}, "time offset -20 ms"},
                        {kRightTurnCorrection, {0, 0.003, 0}, "right camera's turn"},
                        {kFocalCorrection, {-0.002, 0.004}, "focal lengths"}};
  return report;
}

TEST(StartCheck, WhatOptionsHoldStaysAsItWasCalibrated) {
  CheckReport report = FoundAll();
  LeaveOutHeld({}, &report);
  EXPECT_EQ(report.corrections.size(), 3u);
  CalibrationOptions held;
  held.time_offset = false;
  LeaveOutHeld(held, &report);
  ASSERT_EQ(report.corrections.size(), 2u);
  EXPECT_EQ(report.corrections[0].name, kRightTurnCorrection);
  held.right_rotation = false;
  LeaveOutHeld(held, &report);
  ASSERT_EQ(report.corrections.size(), 1u);
  EXPECT_EQ(report.corrections[0].name, kFocalCorrection);
  held.focal_length = false;
  LeaveOutHeld(held, &report);
  EXPECT_TRUE(report.corrections.empty());
}

TEST(StartCheck, CorrectsFocalLengths) {
  Rig rig;
  rig.cameras[0].fx_px = rig.cameras[0].fy_px = rig.cameras[1].fx_px = rig.cameras[1].fy_px = 400;
  const Rig corrected = Corrected(rig, FoundAll());
  EXPECT_NEAR(corrected.cameras[1].fx_px, 401.6, 1e-9);
  EXPECT_NEAR(corrected.cameras[1].fy_px, 401.6, 1e-9);
  EXPECT_NEAR(corrected.cameras[0].fx_px, 399.2, 1e-9);
}

}  // namespace
}  // namespace slcmap
