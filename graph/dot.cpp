#include "graph/dot.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <vector>

#include "base/text.h"

namespace kpsa::engine {
namespace {

constexpr double kReddestShare = 1.0 / 3;  // of the time, and above

struct NodeLook {
  bool kept = false, drawn = false;
  bool lazy_only = true;
  Index points = 0, points_total = 0;
  double ns = 0;
};

std::string Escaped(std::string_view text) {
  std::string escaped;
  for (char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return escaped;
}

// From pale yellow (nothing) to red.
std::string HeatColor(double share) {
  const auto level = static_cast<int>(255 * (1 - std::clamp(share / kReddestShare, 0.0, 1.0)));
  return fmt::format("#ff{:02x}{:02x}", 60 + level * 190 / 255, 40 + level * 160 / 255);
}

class Drawing {
 public:
  Drawing(const Graph& graph, const Plan& plan, const DotOptions& options)
      : graph_(graph), plan_(plan), options_(options), looks_(graph.node_capacity()) {}

  std::string Draw() {
    Look();
    text_ =
        "digraph rig {\n  rankdir=LR;\n  node [shape=box, style=filled, fillcolor=white, "
        "fontname=\"sans-serif\"];\n";
    for (NodeId id : graph_.Nodes()) DrawNode(id);
    DrawArrows();
    return text_ + "}\n";
  }

 private:
  void Look() {
    for (Index s = 0; s < plan_.steps().size(); ++s) {
      const Plan::StepInfo& info = plan_.infos()[s];
      NodeLook& look = looks_[info.node.index];
      look.kept = true;
      look.lazy_only = look.lazy_only && info.segment != 0;
      if (info.points > look.points) look.points = info.points, look.points_total = info.points_total;
      if (options_.profile == nullptr) continue;
      const auto ns = static_cast<double>(options_.profile->self_ns()[s]);
      look.ns += ns, total_ns_ += ns;
    }
    for (const Plan::Varying& v : plan_.varying()) looks_[v.plug.node.index].kept = true;
    for (const Plan::Excluded& e : plan_.excluded()) left_out_.emplace(e.node_name, e.reason);
  }

  std::string Style(NodeId id, const NodeLook& look) const {
    if (!look.kept) {
      const auto reason = left_out_.find(graph_.name(id));
      return "style=\"filled,dashed\", fillcolor=\"#eeeeee\", fontcolor=\"#888888\", tooltip=" +
             DotQuoted(reason == left_out_.end() ? "" : reason->second);
    }
    if (options_.profile != nullptr)
      return "fillcolor=" + DotQuoted(HeatColor(total_ns_ > 0 ? look.ns / total_ns_ : 0));
    return look.lazy_only && look.points_total > 0 ? "fillcolor=\"#ffe9b3\", tooltip=\"only on demand\""
                                                   : "fillcolor=\"#d8f0d8\"";
  }

  void DrawNode(NodeId id) {
    NodeLook& look = looks_[id.index];
    look.drawn =
        (look.kept || options_.all) && (id.index >= options_.hidden.size() || !options_.hidden[id.index]);
    if (!look.drawn) return;
    std::string label = Escaped(graph_.name(id)) + "\\n" + Escaped(graph_.def(id).name);
    if (look.points_total > 0)
      label += fmt::format("\\n{} of {} points", Thousands(look.points), Thousands(look.points_total));
    if (options_.profile != nullptr && look.kept) {
      label += fmt::format("\\n{:.1f} us",
                           look.ns / static_cast<double>(std::max<std::size_t>(options_.frames, 1)) / 1e3);
    }
    text_ += fmt::format("  n{} [label=\"{}\", {}];\n", id.index, label, Style(id, look));
  }

  // One arrow for all connections between two nodes.
  void DrawArrows() {
    struct Arrow {
      std::string first;
      std::size_t count = 0;
    };
    std::map<std::pair<Index, Index>, Arrow> arrows;
    const auto attribute = [&](const PlugRef& plug) -> const std::string& {
      return graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].name;
    };
    for (NodeId id : graph_.Nodes()) {
      if (!looks_[id.index].drawn) continue;
      for (const Connection& c : graph_.Inputs(id)) {
        if (!looks_[c.source.node.index].drawn) continue;
        Arrow& arrow = arrows[{c.source.node.index, id.index}];
        if (arrow.count++ == 0) arrow.first = attribute(c.source) + " > " + attribute(c.destination);
      }
    }
    for (const auto& [ends, arrow] : arrows) {
      const std::string more = arrow.count > 1 ? fmt::format(" and {} more", arrow.count - 1) : "";
      text_ +=
          fmt::format("  n{} -> n{} [tooltip={}];\n", ends.first, ends.second, DotQuoted(arrow.first + more));
    }
  }

  const Graph& graph_;
  const Plan& plan_;
  const DotOptions& options_;
  std::vector<NodeLook> looks_;                            // by node index
  std::unordered_map<std::string, std::string> left_out_;  // reasons by node name
  double total_ns_ = 0;
  std::string text_;
};

}  // namespace

std::string DotQuoted(std::string_view text) { return "\"" + Escaped(text) + "\""; }

std::string DrawDot(const Graph& graph, const Plan& plan, const DotOptions& options) {
  return Drawing(graph, plan, options).Draw();
}

}  // namespace kpsa::engine
