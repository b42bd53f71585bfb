// What the check of a sequence found.
#pragma once

#include <string>
#include <vector>

#include "data/core/types.h"
#include "data/source/sequence.h"

namespace slcmap::inline data {

// A measured property, such as {"image rate", 20, "Hz"}.
struct CheckFigure {
  std::string name;
  double value = 0;
  std::string unit;
};

enum class Severity { kNote, kWarning, kError };

// Something wrong, and what to do about it. With an error the sequence is of no use as it is; a
// note says what could not be told.
struct CheckFinding {
  Severity severity = Severity::kWarning;
  std::string name;  // a word for scripts, such as "imu-units"
  std::string found;
  std::string remedy;
};

// Whether rows were made to fit by turning the right camera: then they say nothing of the turns
// that they do not show.
bool TurnRight(const std::vector<CheckCorrection>& corrections);

struct CheckReport {
  std::string sequence;
  std::string calibration;                              // where it was read, and which transforms
  std::vector<std::string> cameras = {"cam0", "cam1"};  // in whose place remedies name these
  std::string form;                                     // how the recording is kept
  std::vector<RecordedTopic> topics;                    // of one in a bag
  std::vector<CheckFigure> figures;
  std::vector<CheckFinding> findings;
  std::vector<CheckCorrection> corrections;

  void AddFigure(const std::string& name, double value, const std::string& unit) {
    figures.push_back({name, value, unit});
  }
  void Note(const std::string& name, const std::string& found, const std::string& remedy) {
    findings.push_back({Severity::kNote, name, found, Named(remedy)});
  }
  void Warn(const std::string& name, const std::string& found, const std::string& remedy) {
    findings.push_back({Severity::kWarning, name, found, Named(remedy)});
  }
  void Fail(const std::string& name, const std::string& found, const std::string& remedy) {
    findings.push_back({Severity::kError, name, found, Named(remedy)});
  }
  bool Usable() const;                                 // no finding is an error
  std::string Named(const std::string& remedy) const;  // with the cameras' names
};

// The rig with the corrections of a report.
Rig Corrected(const Rig& rig, const CheckReport& report);

std::string CheckTable(const CheckReport& report);  // to read
std::string CheckJson(const CheckReport& report);   // to compute with

}  // namespace slcmap::data
