// One table of the viewer's page (docs/viewer-data.md).
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace kpsa::engine {

class PageTable {
 public:
  struct Column {
    std::string name, unit = {};
  };
  using Cell = std::variant<std::monostate, double, std::string>;  // nothing, a number, a text
  PageTable(std::string title, std::string note, std::vector<Column> columns)
      : title_(std::move(title)), note_(std::move(note)), columns_(std::move(columns)) {}
  void Row(std::vector<Cell> cells) { rows_.push_back(std::move(cells)); }
  bool empty() const { return rows_.empty(); }
  std::string Json() const;

 private:
  std::string title_, note_;
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
};

// A number to four digits; nothing where it is not finite.
PageTable::Cell ShortCell(double value);
PageTable::Cell MillimetreCell(double metres);
PageTable::Cell PercentCell(double share);
PageTable::Cell CountCell(std::size_t count);
double PartOf(std::size_t part, std::size_t all);  // 0 of none

}  // namespace kpsa::engine
