// An object on the heap whose owner can be copied: the copy has one of its own. Its address stays when it is
// moved.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

namespace kpsa::engine {

template <typename T>
class Cloned {
 public:
  Cloned() = default;
  Cloned(std::unique_ptr<T> object) : object_(std::move(object)) {}  // NOLINT: implicit by design
  Cloned(const Cloned& other) : object_(other.object_ ? std::make_unique<T>(*other.object_) : nullptr) {}
  Cloned(Cloned&&) noexcept = default;
  Cloned& operator=(Cloned other) noexcept {
    object_ = std::move(other.object_);
    return *this;
  }
  ~Cloned() = default;
  T* get() const { return object_.get(); }
  T& operator*() const { return *object_; }
  T* operator->() const { return object_.get(); }
  explicit operator bool() const { return object_ != nullptr; }
  friend bool operator==(const Cloned& a, std::nullptr_t) { return a.object_ == nullptr; }

 private:
  std::unique_ptr<T> object_;
};

}  // namespace kpsa::engine
