// Tables of text for people: columns as wide as their longest cell.
#pragma once

#include <string>
#include <vector>

namespace kpsa::engine {

class Table {
 public:
  // One header a column; those that begin with '>' are right-aligned (the mark is not printed).
  explicit Table(std::vector<std::string> headers);
  void Row(std::vector<std::string> cells);  // missing cells are empty
  bool empty() const { return rows_.empty(); }
  std::string Text() const;  // with a rule under the headers; every line ends with a newline
  std::string Markdown() const;

 private:
  std::vector<std::string> headers_;
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace kpsa::engine
