// The generated heads, made once for all tests.
#pragma once

#include <map>

#include "scenes/face_model.h"

namespace kpsa::engine::scenes {

inline const HeadShape& ShapeOf(const HeadDesign& design) {
  static std::map<std::string, HeadShape> shapes;
  const auto found = shapes.find(design.name);
  return found != shapes.end() ? found->second
                               : shapes.emplace(design.name, MakeHeadShape(design)).first->second;
}

}  // namespace kpsa::engine::scenes
