#include "mapping/lines/place_views.h"

namespace slcmap {
namespace {

void DropEverySecondView(TrackedLine* line) {
  int last = -1;
  bool drops = true;                                         // the view before the first
  std::erase_if(line->places, [&](const EdgePlace& place) {  // in the order of their views
    if (place.view != last) drops = !drops;
    last = place.view;
    return drops;
  });
  line->views_kept = (line->views_kept + 1) / 2;
  line->view_step *= 2;
}

}  // namespace

void LimitViews(size_t before, int max_views, TrackedLine* line) {
  if (line->places.size() == before) return;
  if (line->views_shown++ % line->view_step != 0) {
    line->places.resize(before);
  } else if (++line->views_kept > max_views) {
    DropEverySecondView(line);
  }
}

}  // namespace slcmap
