#include "mapping/adjustment/elimination_order.h"

#include <metis.h>
#include <signal.h>

#include <algorithm>
#include <mutex>
#include <unordered_map>

#include "data/error.h"

namespace slcmap {
namespace {

// Blocks by their place in the problem; each vertex knows its neighbours.
using Neighbours = std::vector<std::vector<idx_t>>;

constexpr idx_t kLeftOut = -1;  // a block that is no vertex

// METIS sets handlers of its own for the signals that end a program, takes what the thread that it
// runs on gets for an error, and puts others back with other flags. So this thread gets them when
// METIS is done, and their handlers are put back as they were.
class SignalsLater {
 public:
  SignalsLater() {
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ending, &mask_);
    sigaction(SIGTERM, nullptr, &on_term_);
    sigaction(SIGABRT, nullptr, &on_abort_);
  }
  ~SignalsLater() {
    sigaction(SIGTERM, &on_term_, nullptr);
    sigaction(SIGABRT, &on_abort_, nullptr);
    pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
  }
  SignalsLater(const SignalsLater&) = delete;
  SignalsLater& operator=(const SignalsLater&) = delete;

 private:
  sigset_t mask_;
  struct sigaction on_term_, on_abort_;
};

// The vertices of a graph, neighbours[begins[v]] to neighbours[begins[v + 1]] of each, in the order
// of their elimination. METIS draws from the C library's numbers, which are the process's.
std::vector<idx_t> NestedDissection(std::vector<idx_t> begins, std::vector<idx_t> neighbours,
                                    std::vector<idx_t> sizes) {
  static std::mutex mutex;
  const std::scoped_lock one_at_a_time(mutex);
  const SignalsLater signals_later;
  auto count = static_cast<idx_t>(sizes.size());
  std::vector<idx_t> order(sizes.size()), place(sizes.size());
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  if (METIS_NodeND(&count, begins.data(), neighbours.data(), sizes.data(), options, order.data(),
                   place.data()) != METIS_OK) {
    throw Error("METIS found no order for the adjustment's equations");
  }
  return order;
}

class BlockGraph {
 public:
  BlockGraph(const ceres::Problem& problem, const std::vector<double*>& first,
             const std::vector<double*>& last)
      : problem_(problem) {
    problem.GetParameterBlocks(&blocks_);
    for (size_t i = 0; i < blocks_.size(); ++i) index_of_.emplace(blocks_[i], i);
    vertex_of_.assign(blocks_.size(), 0);
    for (const auto* left_out : {&first, &last}) {
      for (const double* block : *left_out) vertex_of_[index_of_.at(block)] = kLeftOut;
    }
    for (size_t i = 0; i < blocks_.size(); ++i) {
      if (vertex_of_[i] == kLeftOut) continue;
      vertex_of_[i] = static_cast<idx_t>(vertices_.size());
      vertices_.push_back(i);
    }
    Connect(first);
  }

  // The blocks that are vertices, in the order of their elimination.
  std::vector<double*> ByNestedDissection() {
    if (vertices_.empty()) return {};
    std::vector<idx_t> begins{0}, neighbours, sizes;
    for (size_t v = 0; v < vertices_.size(); ++v) {
      neighbours.insert(neighbours.end(), neighbours_[v].begin(), neighbours_[v].end());
      begins.push_back(static_cast<idx_t>(neighbours.size()));
      sizes.push_back(problem_.ParameterBlockTangentSize(blocks_[vertices_[v]]));
    }
    std::vector<double*> ordered;
    for (const idx_t v : NestedDissection(begins, neighbours, sizes)) {
      ordered.push_back(blocks_[vertices_[static_cast<size_t>(v)]]);
    }
    return ordered;
  }

 private:
  std::vector<idx_t> VerticesOf(ceres::ResidualBlockId term, size_t* eliminated) const {
    std::vector<double*> bound;
    problem_.GetParameterBlocksForResidualBlock(term, &bound);
    std::vector<idx_t> vertices;
    for (const double* block : bound) {
      const size_t i = index_of_.at(block);
      if (vertex_of_[i] != kLeftOut) vertices.push_back(vertex_of_[i]);
      if (!is_first_[i]) continue;
      if (*eliminated != blocks_.size()) throw Error("a term binds two blocks of group 0");
      *eliminated = i;
    }
    return vertices;
  }

  // Ties the vertices of each term to each other, and those of all terms of one block of `first`.
  void Connect(const std::vector<double*>& first) {
    is_first_.assign(blocks_.size(), false);
    for (const double* block : first) is_first_[index_of_.at(block)] = true;
    neighbours_.resize(vertices_.size());
    std::vector<std::vector<idx_t>> beside(blocks_.size());  // those of `first`
    std::vector<ceres::ResidualBlockId> terms;
    problem_.GetResidualBlocks(&terms);
    for (const ceres::ResidualBlockId term : terms) {
      size_t eliminated = blocks_.size();
      const std::vector<idx_t> vertices = VerticesOf(term, &eliminated);
      if (eliminated == blocks_.size()) {
        TieTogether(vertices);
      } else {
        beside[eliminated].insert(beside[eliminated].end(), vertices.begin(), vertices.end());
      }
    }
    for (std::vector<idx_t>& vertices : beside) {
      MakeUnique(&vertices);
      TieTogether(vertices);
    }
    for (std::vector<idx_t>& of : neighbours_) MakeUnique(&of);
  }

  void TieTogether(const std::vector<idx_t>& vertices) {
    for (const idx_t a : vertices) {
      for (const idx_t b : vertices) {
        if (a != b) neighbours_[static_cast<size_t>(a)].push_back(b);
      }
    }
  }

  static void MakeUnique(std::vector<idx_t>* vertices) {
    std::ranges::sort(*vertices);
    const auto rest = std::ranges::unique(*vertices);
    vertices->erase(rest.begin(), rest.end());
  }

  const ceres::Problem& problem_;
  std::vector<double*> blocks_;
  std::unordered_map<const double*, size_t> index_of_;
  std::vector<idx_t> vertex_of_;  // by block
  std::vector<size_t> vertices_;  // their blocks
  std::vector<bool> is_first_;    // by block
  Neighbours neighbours_;         // by vertex
};

}  // namespace

std::shared_ptr<ceres::ParameterBlockOrdering> EliminationOrder(const ceres::Problem& problem,
                                                                const std::vector<double*>& first,
                                                                const std::vector<double*>& last) {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* block : first) ordering->AddElementToGroup(block, 0);
  int group = 1;
  for (double* block : BlockGraph(problem, first, last).ByNestedDissection()) {
    ordering->AddElementToGroup(block, group++);
  }
  for (double* block : last) ordering->AddElementToGroup(block, group);
  return ordering;
}

}  // namespace slcmap
