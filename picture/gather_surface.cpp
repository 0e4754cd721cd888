// Parts of a picture put together, checked (picture/surface.h).
#include <algorithm>
#include <array>

#include "picture/surface.h"

namespace kpsa::engine {
namespace {

Double3 CornerOf(ConstPointsView p, std::size_t i) { return {p.x[i], p.y[i], p.z[i]}; }

Status CheckPart(const RenderPart& part) {
  const std::size_t n = part.points.size() / 3;
  const auto fits = [](std::size_t size, std::size_t expected) { return size == 0 || size == expected; };
  if (part.points.size() % 3 != 0 || !fits(part.colors.size(), 3 * n) || !fits(part.scalars.size(), n)) {
    return Status::Invalid("a picture's part has {} coordinates, {} colour values and {} scalars",
                           part.points.size(), part.colors.size(), part.scalars.size());
  }
  if (!fits(part.smooth.size(), n) || !fits(part.texture.size(), n) ||
      part.uvs.size() != 2 * part.texture.size())
    return Status::Invalid(
        "a picture's part of {} points shares {} normals and has {} textures and {} coordinates", n,
        part.smooth.size(), part.texture.size(), part.uvs.size());
  for (const Index first : part.smooth) {
    if (first >= n) return Status::Invalid("a normal is shared with point {}, there are {} points", first, n);
  }
  for (const Index texture : part.texture) {
    if (texture != kNoIndex && texture >= part.textures.size())
      return Status::Invalid("a point is covered by texture {} of {}", texture, part.textures.size());
  }
  return {};
}

// What covers the part's triangles, from `first` on in the surface; nothing while no part had any.
void GatherTextures(const RenderPart& part, std::size_t base, std::size_t first, Surface* out) {
  const bool covered = !part.texture.empty() && part.scalars.empty();
  if (!covered && out->textures.empty()) return;
  out->textures.resize(first / 3, nullptr);
  out->uvs.resize(base, {0, 0});
  for (std::size_t t = first; t < out->triangles.size(); t += 3) {
    const Index texture = covered ? part.texture[out->triangles[t] - base] : kNoIndex;
    out->textures.push_back(texture == kNoIndex ? nullptr : &part.textures[texture]);
  }
  for (std::size_t i = 0; i < part.points.size() / 3; ++i)
    out->uvs.push_back(covered ? std::array{part.uvs[2 * i], part.uvs[2 * i + 1]} : std::array{0.0f, 0.0f});
}

}  // namespace

Result<Surface> GatherSurface(const RenderInput& input) {
  Surface out;
  std::size_t count = 0;
  for (const RenderPart& part : input.parts) {
    KPSA_RETURN_IF_ERROR(CheckPart(part));
    count += part.points.size() / 3;
  }
  out.points = PointBuffer(count);
  const PointsView p = out.points.view();
  std::size_t base = 0;
  for (const RenderPart& part : input.parts) {
    const std::size_t n = part.points.size() / 3;
    for (std::size_t i = 0; i < n; ++i) {
      p.x[base + i] = part.points[3 * i];
      p.y[base + i] = part.points[3 * i + 1];
      p.z[base + i] = part.points[3 * i + 2];
      Double3 color = part.color;
      if (!part.colors.empty()) color = {part.colors[3 * i], part.colors[3 * i + 1], part.colors[3 * i + 2]};
      if (!part.scalars.empty()) color = LinearFromRgb(TurboColor(part.scalars[i] / input.scalar_max));
      out.colors.push_back(color);
      out.matte.push_back(part.scalars.empty() ? 0 : 1);
      out.shares.push_back(static_cast<Index>(base + (part.smooth.empty() ? i : part.smooth[i])));
    }
    const auto first = static_cast<std::ptrdiff_t>(out.triangles.size());
    for (Index index : part.triangles) {
      if (index >= n) return Status::Invalid("a triangle names point {}, there are {} points", index, n);
      out.triangles.push_back(static_cast<Index>(base) + index);
    }
    out.triangles.resize(out.triangles.size() / 3 * 3);
    GatherTextures(part, base, static_cast<std::size_t>(first), &out);
    base += n;
    if (part.casts_shadows)
      out.casting.insert(out.casting.end(), out.triangles.begin() + first, out.triangles.end());
  }
  out.normals.resize(count);
  for (std::size_t t = 0; t < out.triangles.size(); t += 3) {
    const Index a = out.triangles[t], b = out.triangles[t + 1], c = out.triangles[t + 2];
    const Double3 n = Cross(CornerOf(p, b) - CornerOf(p, a), CornerOf(p, c) - CornerOf(p, a));
    for (Index i : {a, b, c}) out.normals[out.shares[i]] = out.normals[out.shares[i]] + n;
  }
  for (Double3& n : out.normals) n = UnitVector(n);
  for (std::size_t i = 0; i < count; ++i) out.normals[i] = out.normals[out.shares[i]];
  return out;
}

double Diagonal(const RenderInput& input, Double3* center) {
  Double3 low = {1e30, 1e30, 1e30}, high = {-1e30, -1e30, -1e30};
  for (const RenderPart& part : input.parts) {
    for (std::size_t i = 0; i < part.points.size(); ++i) {
      const int axis = static_cast<int>(i % 3);
      low[axis] = std::min(low[axis], static_cast<double>(part.points[i]));
      high[axis] = std::max(high[axis], static_cast<double>(part.points[i]));
    }
  }
  if (low.x > high.x) low = high = {0, 0, 0};
  *center = (low + high) * 0.5;
  return Length(high - low);
}

}  // namespace kpsa::engine
