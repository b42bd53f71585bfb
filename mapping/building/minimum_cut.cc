#include "mapping/building/minimum_cut.h"

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>

namespace slcmap {
namespace {

// A flow network with residual capacities, as Boost asks for it.
using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using EdgeOf = Traits::edge_descriptor;
using NodeProperties =
    boost::property<boost::vertex_color_t, boost::default_color_type,
                    boost::property<boost::vertex_distance_t, long,
                                    boost::property<boost::vertex_predecessor_t, EdgeOf>>>;
using EdgeProperties =
    boost::property<boost::edge_capacity_t, double,
                    boost::property<boost::edge_residual_capacity_t, double,
                                    boost::property<boost::edge_reverse_t, EdgeOf>>>;
using Network = boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, NodeProperties,
                                      EdgeProperties>;

void Connect(size_t a, size_t b, double forth, double back, Network* network) {
  const EdgeOf there = boost::add_edge(a, b, *network).first;
  const EdgeOf here = boost::add_edge(b, a, *network).first;
  boost::put(boost::edge_capacity, *network, there, forth);
  boost::put(boost::edge_capacity, *network, here, back);
  boost::put(boost::edge_reverse, *network, there, here);
  boost::put(boost::edge_reverse, *network, here, there);
}

}  // namespace

std::vector<bool> LeastCostLabels(const std::vector<LabelCosts>& things,
                                  const std::vector<PairCost>& pairs) {
  const size_t inside = things.size(), outside = inside + 1;
  Network network(things.size() + 2);
  for (size_t i = 0; i < things.size(); ++i) {
    // Cut off from the inside, it is outside.
    Connect(inside, i, things[i].outside, 0, &network);
    Connect(i, outside, things[i].inside, 0, &network);
  }
  for (const PairCost& pair : pairs) Connect(pair.a, pair.b, pair.cost, pair.cost, &network);
  boost::boykov_kolmogorov_max_flow(network, inside, outside);
  const auto colours = boost::get(boost::vertex_color, network);
  std::vector<bool> labels;
  for (size_t i = 0; i < things.size(); ++i) {
    labels.push_back(boost::get(colours, i) == boost::black_color);
  }
  return labels;
}

}  // namespace slcmap
