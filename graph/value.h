// Typed values. Small ones (bool to matrix) live in 8-byte-aligned slots of an evaluator; points, colors and
// weights are buffers (base/points.h); everything structural is a string, a list or an immutable Asset.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <typeindex>
#include <utility>
#include <variant>
#include <vector>

#include "base/digest.h"
#include "base/points.h"
#include "base/types.h"

namespace kpsa::engine {

enum class Type : std::uint8_t {
  kBool,        // slot: std::int64_t 0 or 1
  kInt,         // slot: std::int64_t
  kEnum,        // slot: std::int64_t, an index into the attribute's names
  kDouble,      // slot: double
  kDouble3,     // slot: Double3; children .x .y .z
  kQuaternion,  // slot: Quaternion; children .x .y .z .w
  kMatrix,      // slot: Matrix4
  kPoints,      // slot: PointsView, 3 components; children [i] and [i].x
  kColors,      // slot: PointsView, 3 components
  kWeights,     // slot: PointsView, 1 component
  kString,      // structural only, as are all that follow
  kInts,        // list of integers (divisions, vertex lists)
  kDoubles,     // list of numbers
  kMesh,        // Asset: Mesh (graph/geometry.h)
  kCurve,       // Asset: Curve (graph/geometry.h)
  kAsset,       // any other Asset
};
const char* TypeName(Type type);
inline bool IsPointType(Type type) { return type >= Type::kPoints && type <= Type::kWeights; }
inline bool IsSmallType(Type type) { return type <= Type::kMatrix; }
inline int PointComponents(Type type) { return type == Type::kWeights ? 1 : 3; }
// Bytes of a slot (a multiple of 8); 0 for types that never flow at run time.
std::size_t SlotSize(Type type);

// An immutable structural object: a mesh, skin weights, animation keys, a subspace. Shared between graphs,
// plans and threads. Derived data that nodes compute from it (adjacency, ...) is cached beside it by type.
class Asset {
 public:
  Asset() = default;
  Asset(const Asset&) = delete;
  Asset& operator=(const Asset&) = delete;
  virtual ~Asset() = default;
  virtual const char* kind() const = 0;  // "mesh", "influences", ...
  virtual Digest digest() const = 0;

  // The T of this asset, made by `make()` at the first call. Thread-safe; never call it from compute.
  template <typename T, typename F>
  const T& Derived(F&& make) const {
    std::lock_guard<std::recursive_mutex> lock(mutex_);
    for (const auto& [type, object] : derived_) {
      if (type == std::type_index(typeid(T))) return *static_cast<const T*>(object.get());
    }
    auto made = std::make_shared<const T>(make());
    derived_.emplace_back(std::type_index(typeid(T)), made);
    return *made;
  }

 private:
  mutable std::recursive_mutex mutex_;
  mutable std::vector<std::pair<std::type_index, std::shared_ptr<const void>>> derived_;
};

using AssetPtr = std::shared_ptr<const Asset>;
using PointBufferPtr = std::shared_ptr<const PointBuffer>;

// A value that a graph holds for a plug (or that a static evaluation gave). Empty where nothing was set.
class Value {
 public:
  using Storage =
      std::variant<std::monostate, std::int64_t, double, Double3, Quaternion, Matrix4, std::string,
                   std::vector<std::int64_t>, std::vector<double>, AssetPtr, PointBufferPtr>;
  Value() = default;
  Value(bool v) : storage_(static_cast<std::int64_t>(v)) {}       // NOLINT: all implicit by design
  Value(int v) : storage_(static_cast<std::int64_t>(v)) {}        // NOLINT
  Value(std::int64_t v) : storage_(v) {}                          // NOLINT
  Value(double v) : storage_(v) {}                                // NOLINT
  Value(Double3 v) : storage_(v) {}                               // NOLINT
  Value(Quaternion v) : storage_(v) {}                            // NOLINT
  Value(const Matrix4& v) : storage_(v) {}                        // NOLINT
  Value(const char* v) : storage_(std::string(v)) {}              // NOLINT
  Value(std::string v) : storage_(std::move(v)) {}                // NOLINT
  Value(std::vector<std::int64_t> v) : storage_(std::move(v)) {}  // NOLINT
  Value(std::vector<double> v) : storage_(std::move(v)) {}        // NOLINT
  Value(PointBufferPtr v) : storage_(std::move(v)) {}             // NOLINT
  template <typename T>
  requires std::is_base_of_v<Asset, T> Value(std::shared_ptr<T> v)
      : storage_(AssetPtr(std::move(v))) {}  // NOLINT

  bool empty() const { return std::holds_alternative<std::monostate>(storage_); }
  template <typename T>
  const T* get_if() const {
    return std::get_if<T>(&storage_);
  }
  // The value as T; the caller knows that it holds one (the graph checked the type).
  template <typename T>
  const T& get() const {
    return std::get<T>(storage_);
  }
  template <typename T>
  const T* asset() const {
    const auto* p = std::get_if<AssetPtr>(&storage_);
    return p == nullptr ? nullptr : dynamic_cast<const T*>(p->get());
  }
  const PointBuffer* points() const {
    const auto* p = std::get_if<PointBufferPtr>(&storage_);
    return p == nullptr ? nullptr : p->get();
  }
  double AsDouble() const;  // of a number; 0 for anything else
  std::int64_t AsInt() const;
  Digest digest() const;
  std::string ToString() const;  // for messages and tables; buffers and assets by kind and size

  // Whether the value may be set on an attribute of that type (int -> double widens).
  bool FitsType(Type type) const;
  // Writes a small value into its slot (SlotSize(type) bytes).
  void WriteSlot(Type type, std::byte* slot) const;
  static Value ReadSlot(Type type, const std::byte* slot);

 private:
  Storage storage_;
};

// The numbers of a small value, in its slot's order; none of other values. Those of a whole number are in
// *whole.
std::span<const double> NumbersOf(const Value& value, double* whole);

}  // namespace kpsa::engine
