// What an exception says that somebody else threw: a plugin's node, a host's callback, the allocator.
#pragma once

#include <exception>
#include <new>
#include <string>

namespace kpsa::engine {

// Of the exception that is being handled: its text, never empty. In a catch block only.
inline std::string ThrownText() {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return "not enough memory";
  } catch (const std::exception& error) {
    const std::string what = error.what();
    return what.empty() ? "threw an exception without a text" : what;
  } catch (...) {
    return "threw an exception of an unknown type";
  }
}

}  // namespace kpsa::engine
