// What the check of a sequence found.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// A measured property, such as {"image rate", 20, "Hz"}.
struct CheckFigure {
  std::string name;
  double value = 0;
  std::string unit;
};

enum class Severity { kWarning, kError };

// Something wrong, and what to do about it. With an error the sequence is of no use as it is.
struct CheckFinding {
  Severity severity = Severity::kWarning;
  std::string name;  // a word for scripts, such as "imu-units"
  std::string found;
  std::string remedy;
};

struct CheckReport {
  std::string sequence;
  std::string calibration;  // where it was read, and which transforms
  std::vector<CheckFigure> figures;
  std::vector<CheckFinding> findings;

  void AddFigure(const std::string& name, double value, const std::string& unit) {
    figures.push_back({name, value, unit});
  }
  void Warn(const std::string& name, const std::string& found, const std::string& remedy) {
    findings.push_back({Severity::kWarning, name, found, remedy});
  }
  void Fail(const std::string& name, const std::string& found, const std::string& remedy) {
    findings.push_back({Severity::kError, name, found, remedy});
  }
  bool Usable() const;  // no finding is an error
};

std::string CheckTable(const CheckReport& report);  // to read
std::string CheckJson(const CheckReport& report);   // to compute with

}  // namespace slcmap
