#include "tests/export/cad/ifc_rules.h"

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

namespace slcmap::testing {
namespace {

// Of each entity its attributes in their order: g identity, m mandatory, o optional, * derived.
constexpr char kAttributes[] =
    "ANNOTATION goooooo APPLICATION mmmm ARBITRARYCLOSEDPROFILEDEF mom "
    "ARBITRARYPROFILEDEFWITHVOIDS momm AXIS2PLACEMENT2D mo AXIS2PLACEMENT3D moo "
    "BUILDING gooooooooooo BUILDINGELEMENTPROXY goooooooo BUILDINGSTOREY gooooooooo "
    "CARTESIANPOINT m CIRCLEPROFILEDEF moom COLOURRGB ommm CURVESTYLE ooooo DIRECTION m "
    "DOOR goooooooooooo ELEMENTQUANTITY goooom EXTRUDEDAREASOLID momm GEOMETRICCURVESET m "
    "GEOMETRICREPRESENTATIONCONTEXT oomomo GEOMETRICREPRESENTATIONSUBCONTEXT oo****momo "
    "LOCALPLACEMENT om OPENINGELEMENT goooooooo ORGANIZATION omooo OWNERHISTORY mmooooom "
    "PERSON oooooooo PERSONANDORGANIZATION mmo PIPESEGMENT goooooooo POLYLINE m "
    "PRODUCTDEFINITIONSHAPE oom PROJECT goooooooo PROPERTYLISTVALUE mooo PROPERTYSET gooom "
    "PROPERTYSINGLEVALUE mooo QUANTITYAREA moomo QUANTITYLENGTH moomo "
    "RECTANGLEPROFILEDEF moomm RELAGGREGATES gooomm RELCONTAINEDINSPATIALSTRUCTURE gooomm "
    "RELDEFINESBYPROPERTIES gooomm RELFILLSELEMENT gooomm RELVOIDSELEMENT gooomm "
    "SHAPEREPRESENTATION moom SITE gooooooooooooo SIUNIT *mom SLAB goooooooo "
    "SPACE goooooooooo STYLEDITEM omo SURFACESTYLE omm SURFACESTYLESHADING mo "
    "UNITASSIGNMENT m WALL goooooooo WINDOW goooooooooooo";

const std::map<std::string, std::string>& Attributes() {
  static const std::map<std::string, std::string> attributes = [] {
    std::map<std::string, std::string> read;
    std::istringstream words(kAttributes);
    for (std::string type, kinds; words >> type >> kinds;) read["IFC" + type] = kinds;
    return read;
  }();
  return attributes;
}

const std::set<std::string> kElements = {
    "IFCWALL",       "IFCSLAB", "IFCDOOR", "IFCWINDOW", "IFCANNOTATION", "IFCBUILDINGELEMENTPROXY",
    "IFCPIPESEGMENT"};
// Where types hold what the rules speak of, counted from 0.
constexpr size_t kShape = 6;  // of a product

class Rules {
 public:
  explicit Rules(const std::string& text) : entities_(ParseStep(text)) {
    for (const auto& [reference, entity] : entities_) {
      for (size_t i = 0; i < entity.attributes.size(); ++i) {
        for (const std::string& used : ReferencesIn(entity.attributes[i])) {
          users_[used].emplace_back(entity.type, i);
        }
      }
    }
  }

  std::vector<std::string> Faults() {
    for (const auto& [reference, entity] : entities_) {
      reference_ = reference;
      CheckAttributes(entity);
    }
    if (!faults_.empty()) return faults_;  // what follows takes attributes by their number
    for (const auto& [reference, entity] : entities_) {
      reference_ = reference;
      CheckIdentity(entity);
      if (entity.type == "IFCSHAPEREPRESENTATION") CheckContext(entity);
      if (entity.type == "IFCPROPERTYSET") CheckName(entity);
      CheckUse(entity);
    }
    return faults_;
  }

 private:
  void Add(const std::string& what) {
    faults_.push_back(reference_ + " " + entities_[reference_].type + ": " + what);
  }

  void CheckAttributes(const StepEntity& entity) {
    const auto known = Attributes().find(entity.type);
    if (known == Attributes().end()) return Add("unknown");
    const std::string& kinds = known->second;
    if (entity.attributes.size() != kinds.size()) return Add("number of attributes");
    for (size_t i = 0; i < kinds.size(); ++i) {
      const std::string& value = entity.attributes[i];
      if (value == "$" && (kinds[i] == 'm' || kinds[i] == 'g')) Add("mandatory");
      if ((value == "*") != (kinds[i] == '*')) Add("derived");
      for (const std::string& reference : ReferencesIn(value)) {
        if (entities_.count(reference) == 0) Add("dangling " + reference);
      }
    }
  }

  void CheckIdentity(const StepEntity& entity) {
    if (Attributes().at(entity.type)[0] != 'g') return;
    static const std::regex form("'[0-3][0-9A-Za-z_$]{21}'");
    const std::string& guid = entity.attributes[0];
    if (!std::regex_match(guid, form)) Add("form of " + guid);
    if (!guids_.insert(guid).second) Add("repeated " + guid);
  }

  void CheckContext(const StepEntity& entity) {
    const StepEntity& context = entities_[entity.attributes[0]];
    if (context.type != "IFCGEOMETRICREPRESENTATIONSUBCONTEXT" ||
        context.attributes[0] != entity.attributes[1]) {
      Add("context of another name");
    }
  }

  void CheckName(const StepEntity& entity) {
    if (entity.attributes[2].rfind("'slcmap_", 0) != 0) Add("name of a set of the standard's");
  }

  // How often entities of a type refer to this one, in that attribute.
  int Uses(const std::string& user, size_t attribute) {
    const auto& users = users_[reference_];
    return static_cast<int>(std::count(users.begin(), users.end(), std::pair(user, attribute)));
  }

  int ProductsOfShape() {
    const auto& users = users_[reference_];
    return static_cast<int>(std::count_if(users.begin(), users.end(), [](const auto& user) {
      return Attributes().at(user.first)[0] == 'g' && user.second == kShape;
    }));
  }

  void CheckUse(const StepEntity& entity) {
    if (entity.type == "IFCSHAPEREPRESENTATION" && Uses("IFCPRODUCTDEFINITIONSHAPE", 2) != 1) {
      Add("not in one shape");
    }
    if (entity.type == "IFCPRODUCTDEFINITIONSHAPE" && ProductsOfShape() != 1) {
      Add("not of one product");
    }
    const int contained = Uses("IFCRELCONTAINEDINSPATIALSTRUCTURE", 4);
    if (contained != (kElements.count(entity.type) > 0 ? 1 : 0)) Add("contained as often as that");
    if (entity.type == "IFCOPENINGELEMENT" && Uses("IFCRELVOIDSELEMENT", 5) != 1) Add("no wall");
    const bool is_part = entity.type == "IFCSITE" || entity.type == "IFCBUILDING" ||
                         entity.type == "IFCBUILDINGSTOREY" || entity.type == "IFCSPACE";
    if (is_part && Uses("IFCRELAGGREGATES", 5) != 1) Add("no part of anything");
  }

  StepEntities entities_;
  std::map<std::string, std::vector<std::pair<std::string, size_t>>> users_;  // type, attribute
  std::string reference_;                                                     // of what is checked
  std::set<std::string> guids_;
  std::vector<std::string> faults_;
};

// Splits at commas that are in no text and no list.
std::vector<std::string> Split(const std::string& attributes) {
  std::vector<std::string> values(1);
  int depth = 0;
  bool in_text = false;
  for (const char c : attributes) {
    if (c == '\'') in_text = !in_text;
    if (!in_text) depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0 && !in_text) {
      values.emplace_back();
    } else {
      values.back().push_back(c);
    }
  }
  return values;
}

}  // namespace

StepEntities ParseStep(const std::string& text) {
  StepEntities entities;
  std::istringstream rows(text);
  for (std::string row; std::getline(rows, row);) {
    const size_t equals = row.find('='), open = row.find('(');
    if (row.empty() || row[0] != '#' || equals > open || row.size() < open + 3) continue;
    entities[row.substr(0, equals)] = {row.substr(equals + 1, open - equals - 1),
                                       Split(row.substr(open + 1, row.size() - open - 3))};
  }
  return entities;
}

std::vector<std::string> ReferencesIn(const std::string& attribute) {
  std::vector<std::string> references;
  bool in_text = false;
  for (size_t i = 0; i < attribute.size(); ++i) {
    if (attribute[i] == '\'') in_text = !in_text;
    if (attribute[i] != '#' || in_text) continue;
    const size_t end = attribute.find_first_not_of("0123456789", i + 1);
    references.push_back(attribute.substr(i, end == std::string::npos ? end : end - i));
  }
  return references;
}

std::vector<std::string> FindIfcFaults(const std::string& text) { return Rules(text).Faults(); }

}  // namespace slcmap::testing
