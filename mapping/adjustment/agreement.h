// What several matches between two visits of a place say in common of how far the visits are
// shifted against each other.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace slcmap {

// A shift of the later visit against the earlier one: x, y, z in metres, and a turn about the
// vertical in rad.
using Shift = Eigen::Vector4d;

// A thing seen at the earlier visit, and where it may have been seen again: alternatives that look
// alike. The offset b of the right one fits by_shift * shift = b; both in units of the distance at
// which one is taken to fit.
struct ShiftVote {
  Eigen::Matrix<double, 2, 4> by_shift;
  std::vector<Eigen::Vector2d> alternatives;
};

// How far apart visits may be as odometry knows them: standard deviations.
struct ShiftSigma {
  double position_m = 0;
  double yaw_rad = 0;
};

struct Agreement {
  Shift shift = Shift::Zero();
  std::vector<int> chosen;  // of each vote the alternative that fits, -1 where none does
  int votes = 0;            // that fit
  int runner_up = 0;        // of the best shift that is another one: see FindAgreement()
};

// The shift that most votes fit, found from pairs of them (a fixed sequence of pairs, so that the
// same votes give the same answer), and refined on those that fit. What the votes do not tell of a
// shift is taken to be zero with the given standard deviations; shifts beyond three of them are
// not looked at. Another shift is one that lies more than min_displacement away.
Agreement FindAgreement(const std::vector<ShiftVote>& votes, const ShiftSigma& sigma,
                        double min_displacement_m);

}  // namespace slcmap
