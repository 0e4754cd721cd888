#include "kpsa/name_table.h"

#include <string_view>

#include "files/utf8.h"
#include "kpsa/subspace_tensors.h"

namespace kpsa::engine {
namespace {

constexpr char kNamesKey[] = "names", kNameEndsKey[] = "nameEnds";

}  // namespace

std::uint32_t NameNumbers::Of(const std::string& name) {
  const auto [place, is_new] = numbers_.emplace(name, static_cast<std::uint32_t>(ends_.size()));
  if (is_new) {
    text_ += name;
    ends_.push_back(static_cast<std::uint32_t>(text_.size()));
  }
  return place->second;
}

void NameNumbers::AddTo(SafetensorsWriter* writer) const {
  Add<std::uint8_t>(writer, kNamesKey, {reinterpret_cast<const std::uint8_t*>(text_.data()), text_.size()});
  Add<std::uint32_t>(writer, kNameEndsKey, ends_);
}

Result<NameTable> NameTable::Read(const SafetensorsFile& file) {
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  NameTable table;
  KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(kNamesKey, {kAny}), &table.text_));
  KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(kNameEndsKey, {kAny}), &table.ends_));
  std::size_t begin = 0;
  for (std::size_t i = 0; i < table.ends_.size(); ++i) {
    const std::size_t end = table.ends_[i];
    if (end < begin || end > table.text_.size())
      return Status::Invalid("name {} lies at bytes {} to {} of {}", i, begin, end, table.text_.size());
    const std::string_view name(reinterpret_cast<const char*>(table.text_.data()) + begin, end - begin);
    if (FindNotUtf8(name) != std::string_view::npos) return Status::Invalid("name {} is not UTF-8 text", i);
    begin = end;
  }
  if (begin != table.text_.size())
    return Status::Invalid("{} bytes of names, of which {} belong to one", table.text_.size(), begin);
  return table;
}

Status NameTable::Take(std::uint32_t number, std::string* name) {
  if (number >= ends_.size()) return Status::Invalid("name {} of {} is asked for", number, ends_.size());
  const std::size_t begin = number == 0 ? 0 : ends_[number - 1], size = ends_[number] - begin;
  if (size > kMostText - taken_) return Status::Invalid("names of more than {} bytes in all", kMostText);
  taken_ += size;
  name->assign(reinterpret_cast<const char*>(text_.data()) + begin, size);
  return {};
}

}  // namespace kpsa::engine
