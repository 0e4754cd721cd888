#include "report/page_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/json_text.h"

namespace kpsa::engine {

std::string PageTable::Json() const {
  using Value = nlohmann::ordered_json;
  Value columns = Value::array(), rows = columns;
  for (const Column& column : columns_) {
    columns.push_back({{"name", column.name}});
    if (!column.unit.empty()) columns.back()["unit"] = column.unit;
  }
  for (const std::vector<Cell>& row : rows_) {
    Value cells = Value::array();
    for (const Cell& cell : row) {
      const auto* number = std::get_if<double>(&cell);
      const auto* text = std::get_if<std::string>(&cell);
      if (number != nullptr && *number == std::floor(*number) && std::abs(*number) < 0x1p53) {
        cells.push_back(static_cast<std::int64_t>(*number));
      } else {
        cells.push_back(number != nullptr ? Value(*number) : text != nullptr ? Value(*text) : Value());
      }
    }
    rows.push_back(std::move(cells));
  }
  Value table = {{"title", title_}};
  if (!note_.empty()) table["note"] = note_;
  table["columns"] = std::move(columns);
  table["rows"] = std::move(rows);
  return CompactJson(table);
}

PageTable::Cell ShortCell(double value) {
  if (!std::isfinite(value)) return std::monostate();
  return std::strtod(fmt::format("{:.4g}", value).c_str(), nullptr);  // stod throws at the smallest numbers
}
PageTable::Cell MillimetreCell(double metres) { return ShortCell(metres * 1e3); }
PageTable::Cell PercentCell(double share) { return ShortCell(100 * share); }
PageTable::Cell CountCell(std::size_t count) { return static_cast<double>(count); }

double PartOf(std::size_t part, std::size_t all) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, all));
}

}  // namespace kpsa::engine
