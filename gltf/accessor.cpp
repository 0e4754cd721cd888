#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

// Elements in a buffer: element i starts at data + i * stride. data is null where all are zero.
struct Elements {
  const std::uint8_t* data = nullptr;
  std::size_t stride = 0;
};

unsigned TypeBit(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return kByte;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return kUnsignedByte;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return kShort;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return kUnsignedShort;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return kUnsignedInt;
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return kFloat;
    default:
      return 0;
  }
}

std::string TypeNames(unsigned types) {
  constexpr std::pair<unsigned, const char*> kNames[] = {{kByte, "byte"},
                                                         {kUnsignedByte, "unsigned byte"},
                                                         {kShort, "short"},
                                                         {kUnsignedShort, "unsigned short"},
                                                         {kUnsignedInt, "unsigned int"},
                                                         {kFloat, "float"}};
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if ((types & bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  }
  return text;
}

template <typename T>
T Load(const std::uint8_t* data) {
  T value;
  std::memcpy(&value, data, sizeof(T));
  return value;
}

// One component as a number (glTF 2.0, 3.6.2.2 and 3.11: normalised signed integers are max(c / 127, -1)).
double LoadNumber(const std::uint8_t* data, int component_type, bool normalized) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const double c = Load<std::int8_t>(data);
      return normalized ? std::max(c / 127, -1.0) : c;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return normalized ? Load<std::uint8_t>(data) / 255.0 : Load<std::uint8_t>(data);
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const double c = Load<std::int16_t>(data);
      return normalized ? std::max(c / 32767, -1.0) : c;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return normalized ? Load<std::uint16_t>(data) / 65535.0 : Load<std::uint16_t>(data);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return Load<std::uint32_t>(data);
    default:
      return Load<float>(data);
  }
}

std::size_t ComponentSize(int component_type) {
  return static_cast<std::size_t>(
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component_type)));
}

// `count` elements of `size` bytes from a view, all of them within the view and the view within its buffer.
// All values are below 2^53 (checked when the document was read) and strides below 2^8, so no sum overflows.
Status ResolveView(const Document& document, int view_index, std::uint64_t offset, std::uint64_t count,
                   std::size_t size, bool strided, const std::string& what, Elements* elements) {
  const tinygltf::BufferView& view = document.model->bufferViews[static_cast<std::size_t>(view_index)];
  const std::vector<std::uint8_t>& buffer = document.buffers[static_cast<std::size_t>(view.buffer)];
  if (view.byteOffset + view.byteLength > buffer.size()) {
    if (buffer.empty()) return Status::Invalid("{}: buffers[{}] has no data", what, view.buffer);
    return Status::Invalid("{}: bufferViews[{}] ends at byte {} of buffers[{}], which has {}", what,
                           view_index, view.byteOffset + view.byteLength, view.buffer, buffer.size());
  }
  elements->stride = strided && view.byteStride != 0 ? view.byteStride : size;
  const std::uint64_t end = count == 0 ? 0 : offset + (count - 1) * elements->stride + size;
  if (end > view.byteLength) {
    return Status::Invalid("{}: {} elements need {} bytes of bufferViews[{}], which has {}", what, count, end,
                           view_index, view.byteLength);
  }
  if (elements->stride < size) {
    return Status::Invalid("{}: bufferViews[{}].byteStride is {}, an element has {} bytes", what, view_index,
                           elements->stride, size);
  }
  elements->data = buffer.data() + view.byteOffset + (count == 0 ? 0 : offset);
  return {};
}

// An accessor with everything checked: base elements, and sparse replacements.
struct Access {
  const tinygltf::Accessor* accessor = nullptr;
  std::size_t count = 0, component_size = 0, size = 0;  // bytes of a component and of an element
  int components = 0;
  Elements base;
  std::size_t sparse_count = 0;
  Elements sparse_values;
  std::vector<Index> sparse_indices;
};

Status ReadSparseIndices(const Document& document, const tinygltf::Accessor& accessor,
                         const std::string& what, std::vector<Index>* indices) {
  const int type = accessor.sparse.indices.componentType;
  if ((TypeBit(type) & (kUnsignedByte | kUnsignedShort | kUnsignedInt)) == 0) {
    return Status::Invalid("{}: sparse indices have the component type {}", what, type);
  }
  const auto count = static_cast<std::size_t>(accessor.sparse.count);
  Elements elements;
  KPSA_RETURN_IF_ERROR(ResolveView(document, accessor.sparse.indices.bufferView,
                                   static_cast<std::uint64_t>(accessor.sparse.indices.byteOffset), count,
                                   ComponentSize(type), false, what + " (sparse indices)", &elements));
  indices->reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto index = static_cast<Index>(LoadNumber(elements.data + i * elements.stride, type, false));
    if (index >= accessor.count || (i > 0 && index <= indices->back())) {
      return Status::Invalid("{}: sparse index {} is {}; they must ascend and stay below {}", what, i, index,
                             accessor.count);
    }
    indices->push_back(index);
  }
  return {};
}

Status Open(const Document& document, int index, int components, unsigned types, const std::string& what,
            Access* access) {
  const tinygltf::Accessor& accessor = document.model->accessors[static_cast<std::size_t>(index)];
  const std::string name = fmt::format("{} (accessors[{}])", what, index);
  access->accessor = &accessor;
  if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components ||
      (components == 4 && accessor.type == TINYGLTF_TYPE_MAT2)) {
    return Status::Invalid("{} has the wrong type, expected {} number(s) an element", name, components);
  }
  if ((TypeBit(accessor.componentType) & types) == 0) {
    return Status::Invalid("{} has the component type {}, expected {}", name, accessor.componentType,
                           TypeNames(types));
  }
  if (accessor.count >= kNoIndex) {
    return Status::Invalid("{} has {} elements, the most is {}", name, accessor.count, kNoIndex - 1);
  }
  access->count = accessor.count;
  access->components = components;
  access->component_size = ComponentSize(accessor.componentType);
  access->size = access->component_size * static_cast<std::size_t>(components);
  if (accessor.bufferView != document.no_view) {
    KPSA_RETURN_IF_ERROR(ResolveView(document, accessor.bufferView, accessor.byteOffset, access->count,
                                     access->size, true, name, &access->base));
  }
  if (accessor.sparse.isSparse) {
    access->sparse_count = static_cast<std::size_t>(accessor.sparse.count);
    if (access->sparse_count > access->count) {
      return Status::Invalid("{} has {} sparse elements of {}", name, access->sparse_count, access->count);
    }
    KPSA_RETURN_IF_ERROR(document.budget.TakeWork(4 * access->sparse_count, name));
    KPSA_RETURN_IF_ERROR(ReadSparseIndices(document, accessor, name, &access->sparse_indices));
    KPSA_RETURN_IF_ERROR(ResolveView(document, accessor.sparse.values.bufferView,
                                     static_cast<std::uint64_t>(accessor.sparse.values.byteOffset),
                                     access->sparse_count, access->size, false, name + " (sparse values)",
                                     &access->sparse_values));
  }
  return {};
}

// Calls each(element, component, number) for the elements first the base, then the replacements; all numbers
// are finite, unless `any`.
template <typename Each>
Status ForEachNumber(const Access& access, const std::string& what, const Each& each, bool any = false) {
  const auto visit = [&](std::size_t element, const std::uint8_t* data) -> Status {
    for (int c = 0; c < access.components; ++c) {
      const double number = LoadNumber(data + static_cast<std::size_t>(c) * access.component_size,
                                       access.accessor->componentType, access.accessor->normalized);
      if (!any && !std::isfinite(number)) {
        return Status::Invalid("{}: component {} of element {} is not finite", what, c, element);
      }
      each(element, c, number);
    }
    return {};
  };
  if (access.base.data != nullptr) {
    for (std::size_t i = 0; i < access.count; ++i) {
      KPSA_RETURN_IF_ERROR(visit(i, access.base.data + i * access.base.stride));
    }
  }
  for (std::size_t i = 0; i < access.sparse_count; ++i) {
    KPSA_RETURN_IF_ERROR(
        visit(access.sparse_indices[i], access.sparse_values.data + i * access.sparse_values.stride));
  }
  return {};
}

template <typename T>
Status ReadAll(const Document& document, int accessor, int components, unsigned types,
               const std::string& what, std::vector<T>* values, bool any = false) {
  Access access;
  KPSA_RETURN_IF_ERROR(Open(document, accessor, components, types, what, &access));
  const std::size_t total = access.count * static_cast<std::size_t>(components);
  KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(total * sizeof(T), what));
  KPSA_RETURN_IF_ERROR(document.budget.TakeWork(total * sizeof(T), what));
  values->assign(total, T(0));
  const auto width = static_cast<std::size_t>(components);
  const auto keep = [&](std::size_t element, int component, double number) {
    (*values)[element * width + static_cast<std::size_t>(component)] = static_cast<T>(number);
  };
  return ForEachNumber(access, what, keep, any);
}

}  // namespace

std::size_t AccessorCount(const Document& document, int accessor) {
  return document.model->accessors[static_cast<std::size_t>(accessor)].count;
}

template <typename T>
Status ReadNumbers(const Document& document, int accessor, int components, unsigned types,
                   const std::string& what, std::vector<T>* values) {
  return ReadAll(document, accessor, components, types, what, values);
}
template Status ReadNumbers<float>(const Document&, int, int, unsigned, const std::string&,
                                   std::vector<float>*);
template Status ReadNumbers<double>(const Document&, int, int, unsigned, const std::string&,
                                    std::vector<double>*);

Status ReadDirections(const Document& document, int accessor, unsigned types, const std::string& what,
                      std::vector<float>* values) {
  KPSA_RETURN_IF_ERROR(ReadAll(document, accessor, 3, types, what, values, true));
  for (std::size_t i = 0; i < values->size(); i += 3) {
    float* const v = &(*values)[i];
    if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]))
      std::fill_n(v, 3, std::numeric_limits<float>::quiet_NaN());
  }
  return {};
}

Status ReadIndices(const Document& document, int accessor, int components, unsigned types,
                   const std::string& what, std::vector<Index>* values) {
  if (document.model->accessors[static_cast<std::size_t>(accessor)].normalized) {
    return Status::Invalid("{} (accessors[{}]) holds indices and must not be normalized", what, accessor);
  }
  return ReadAll(document, accessor, components, types & (kUnsignedByte | kUnsignedShort | kUnsignedInt),
                 what, values);
}

Status ReadSparseVectors(const Document& document, int accessor, unsigned types, const std::string& what,
                         std::vector<Index>* indices, std::vector<float>* values) {
  Access access;
  KPSA_RETURN_IF_ERROR(Open(document, accessor, 3, types, what, &access));
  const bool dense = access.base.data != nullptr;
  const std::size_t stored = dense ? access.count : access.sparse_count;
  KPSA_RETURN_IF_ERROR(document.budget.TakeWork(12 * stored, what));

  // Collect element by element; sparse replacements of a dense base need the whole
  std::vector<float> all(3 * stored);
  std::size_t next = 0;
  KPSA_RETURN_IF_ERROR(ForEachNumber(access, what, [&](std::size_t element, int component, double number) {
    const std::size_t at = dense ? 3 * element + static_cast<std::size_t>(component) : next++;
    all[at] = static_cast<float>(number);
  }));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < stored; ++i)
    kept += all[3 * i] != 0 || all[3 * i + 1] != 0 || all[3 * i + 2] != 0;
  KPSA_RETURN_IF_ERROR(document.budget.TakeMemory(16 * kept, what));
  indices->reserve(kept);
  values->reserve(3 * kept);
  for (std::size_t i = 0; i < stored; ++i) {
    if (all[3 * i] == 0 && all[3 * i + 1] == 0 && all[3 * i + 2] == 0) continue;
    indices->push_back(dense ? static_cast<Index>(i) : access.sparse_indices[i]);
    values->insert(values->end(), &all[3 * i], &all[3 * i] + 3);
  }
  return {};
}

}  // namespace kpsa::engine::gltf
