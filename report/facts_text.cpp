#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <variant>

#include "base/quantity_text.h"
#include "base/text.h"
#include "report/file_facts.h"
#include "report/json_text.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

constexpr std::uint32_t kDeepestIndent = 20;  // of a tree; deeper nodes stand below each other

std::string CellText(const FactTable::Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  if (const auto* count = std::get_if<std::uint64_t>(&cell)) return Thousands(*count);
  return fmt::format("{:.6g}", std::get<double>(cell));
}

nlohmann::ordered_json CellJson(const FactTable::Cell& cell) {
  return std::visit([](const auto& value) { return nlohmann::ordered_json(value); }, cell);
}

// "mesh node" -> "mesh_node".
std::string Key(std::string name) {
  if (name.starts_with('>')) name.erase(0, 1);
  for (char& c : name) {
    if (c == ' ') c = '_';
  }
  return name;
}

}  // namespace

std::string FactsJson(const std::string& path, const FileFacts& facts) {
  nlohmann::ordered_json json = {{"schema", "kpsa.inspect/1"}, {"file", path}, {"kind", facts.kind}};
  for (const auto& [name, value] : facts.facts) {
    json[Key(name)] = CellJson(value);
    if (name == "training") {
      // It is JSON in the file already
      const auto training = nlohmann::ordered_json::parse(std::get<std::string>(value), nullptr, false);
      if (!training.is_discarded()) json["training"] = training;
    }
  }
  for (const FactTable& table : facts.tables) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      const auto& row = table.rows[r];
      nlohmann::ordered_json object = nlohmann::ordered_json::object();
      if (!table.depths.empty()) object["depth"] = table.depths[r];
      for (std::size_t c = 0; c < row.size(); ++c) object[Key(table.columns[c])] = CellJson(row[c]);
      rows.push_back(std::move(object));
    }
    json[Key(table.name)] = std::move(rows);
  }
  json["notes"] = facts.notes;
  return JsonText(json);
}

std::string FactsText(const std::string& path, const FileFacts& facts) {
  std::string all = fmt::format("{}: {}\n", path, facts.kind);
  for (const auto& [name, value] : facts.facts) {
    if (name == "training") continue;  // JSON, for --json
    const auto* bytes = std::get_if<std::uint64_t>(&value);
    const std::string text = bytes != nullptr && name.ends_with("bytes") ? ByteText(*bytes) : CellText(value);
    all += fmt::format("  {:<18} {}\n",
                       name.ends_with(" bytes") ? name.substr(0, name.size() - 6)
                       : name == "bytes"        ? "size"
                                                : name,
                       text);
  }
  for (const FactTable& facts_table : facts.tables) {
    if (facts_table.rows.empty()) continue;
    Table table(facts_table.columns);
    for (std::size_t r = 0; r < facts_table.rows.size(); ++r) {
      std::vector<std::string> cells;
      for (const FactTable::Cell& cell : facts_table.rows[r]) cells.push_back(CellText(cell));
      if (!facts_table.depths.empty())
        cells.front().insert(0, 2 * std::min(facts_table.depths[r], kDeepestIndent), ' ');
      table.Row(std::move(cells));
    }
    all += fmt::format("\n{} ({})\n{}", facts_table.name, facts_table.rows.size(), table.Text());
  }
  for (const std::string& note : facts.notes) all += "note: " + note + "\n";
  return all;
}

}  // namespace kpsa::engine
