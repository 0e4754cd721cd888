// The car's shell: rings of quads around the sides under a grid of quads over hood, cabin and trunk, with
// rings of their own around the mouth and the eyes.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/car_model.h"

namespace kpsa::engine::scenes::car {
namespace {

constexpr double kWidth = 88, kLength = 170, kBottom = 20, kBeltScale = 0.965, kSillScale = 0.95;
// Lines of the grid: from the middle to the side, and from front to back
constexpr double kAcross[] = {0, 7, 14, 21, 28, 35, 42, 49, 56, 61, 66, 71, 79, 88};
constexpr double kAlong[] = {170, 159,  146, 131,  115,  98,   81,   65,   53,   44,  37,  32.5,
                             28,  23.5, 19,  14.5, 10,   6,    1,    -5,   -14,  -27, -42, -55,
                             -66, -78,  -90, -102, -114, -126, -138, -150, -161, -170};
constexpr int kHalf = 13, kBack = 33, kColumns = 2 * (2 * kHalf + kBack), kRows = 10;
constexpr int kMouthColumn = 7, kMouthRow0 = 4, kMouthRow1 = 8;
constexpr int kEyeColumn0 = 1, kEyeColumn1 = 7, kEyeRow0 = 10, kEyeRow1 = 16;

double Root4(double v) { return std::sqrt(std::sqrt(std::max(v, 0.0))); }
double Power4(double v) { return v * v * v * v; }

// The smaller one, rounded where they meet.
double SmoothMin(double a, double b, double k) {
  const double h = std::max(k - std::fabs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * k * h * h;
}

double BeltHeight(double z) { return 76 + 8 * Smooth(165, 50, z) - 2 * Smooth(-60, -165, z); }

// Height of the upper surface: deck and cabin.
double TopHeight(double x, double z) {
  const double w = x / (kWidth * kBeltScale), l = z / (kLength * kBeltScale);
  const double q = std::min(1.0, Power4(w) + Power4(l));
  const double deck =
      BeltHeight(z) + 11 * std::sqrt(1 - q) + 3 * Bump(x, 45) * Smooth(160, 110, z) * Smooth(30, 60, z);
  const double front = (40 - z - 8 * (x / 70) * (x / 70)) / 36, back = (z + 128) / 58,
               side = (73 - std::fabs(x)) / 24;
  const double t = SmoothMin(SmoothMin(SmoothMin(front, back, 0.3), side, 0.35), 1, 0.3);
  const double cabin = -SmoothMin(-t, 0, 0.12);
  const double arch =
      12.5 - 7.0 * Power4((std::fabs(x) - 25) / 27);  // the brow's line, in z from the roof's edge
  const double brow = Bump(z - arch + 9, 8.5) * Smooth(4, 10, std::fabs(x)) * Smooth(51, 43, std::fabs(x));
  return deck + 58 * cabin + 4.5 * brow;
}

double RowScale(double v) {
  return kSillScale + (1 - kSillScale) * Smooth(0, 0.45, v) - (1 - kBeltScale) * Smooth(0.5, 1, v);
}

// The front between bottom and belt: the bumper at x and height y.
double FrontDepth(double x, double y) {
  const double v = std::clamp((y - kBottom) / (BeltHeight(kLength) - kBottom), 0.0, 1.0), k = RowScale(v);
  return kLength * k * Root4(1 - Power4(x / (kWidth * k))) +
         7 * Bump(y - 44, 26) * Smooth(85, 40, std::fabs(x));
}

Double3 TopPoint(int i, int j) {
  const double a = (i < 0 ? -kAcross[-i] : kAcross[i]) / kWidth, b = kAlong[j] / kLength;
  const double m = std::max(std::fabs(a), std::fabs(b));
  const double rounded = m > 0 ? m / Root4(Power4(a) + Power4(b)) : 1;  // of the boundary in that direction
  const double scale = kBeltScale * (1 + (rounded - 1) * m * m);
  const double x = kWidth * a * scale, z = kLength * b * scale;
  if (m >= 1) return {x, BeltHeight(z), z};
  return {x, TopHeight(x, z), z};
}

// A point of the sides, column 0 .. kColumns / 2; v from the bottom to the belt.
Double3 SidePoint(int column, double v) {
  const double k = RowScale(v);
  Double3 p;
  double bottom = kBottom;
  if (column <= kHalf || column >= kHalf + kBack) {
    const bool front = column <= kHalf;
    const int i = front ? column : kColumns / 2 - column;
    const double a = kAcross[i] / kWidth, rounded = 1 / Root4(Power4(a) + 1);
    p = {kWidth * k * a * rounded, 0, (front ? 1 : -1) * kLength * k * rounded};
  } else {
    // Along the side the lines lead from the arches to the grid above
    const int j = column - kHalf, mirrored = std::min(j, kBack - j);
    double z = 61.0 * (kBack - 2 * j) / 15.0 * 0.98;
    if (mirrored <= 9) {
      const double angle = (-12 + 25.5 * (mirrored - 1)) * kPi / 180;
      const double forward = kWheelAt + kArch * Cos(angle);
      z = j < kBack / 2 ? forward : -forward;
      bottom = kWheelAxle + kArch * Sin(angle);
    }
    const double low = z / (kLength * kSillScale), b = kAlong[j] / kLength, high = b / Root4(1 + Power4(b));
    const double zn = low + (high - low) * Smooth(0, 0.95, v);
    p = {kWidth * k * Root4(1 - Power4(zn)), 0, kLength * k * zn};
  }
  p.y = bottom + (BeltHeight(p.z) - bottom) * v;
  if (column <= kHalf)
    p.z = std::max(p.z, p.z + FrontDepth(p.x, p.y) - kLength * k * Root4(1 - Power4(p.x / (kWidth * k))));
  if (column >= kHalf + kBack) p.z -= 5 * Bump(p.y - 40, 20) * Smooth(85, 40, p.x);
  const double dy = p.y - kWheelAxle, dz = std::fabs(p.z) - kWheelAt;
  p.x += 5.0 * Bump(std::sqrt(dy * dy + dz * dz) - kArch, 14) * Smooth(60, 75, p.x);  // flared fenders
  return p;
}

// A place on the bumper: around the mouth's line by an angle, `wide` and `high` beyond the opening, `out` of
// the surface.
Double3 AroundMouth(double angle, double wide, double high, double out) {
  double sine, cosine;
  SinCos(angle, &sine, &cosine);
  const double x = (kMouthWidth + wide) * cosine;
  const double line =
      kMouthHeight + 9.0 * (x / kMouthWidth) * (x / kMouthWidth) * Smooth(70, 30, std::fabs(x));
  const double y = line + (4.5 + high) * sine;
  return {x, y, FrontDepth(x, y) + out};
}

// The windscreen's frame at the left eye: right, up along it, outwards.
constexpr Double3 kRight = {1, 0, 0}, kUp = {0, 0.86, -0.51}, kOut = {0, 0.51, 0.86};

Double3 OnWindscreen(double p, double q, double out) {
  Double3 at = kEye + kRight * p + kUp * q;
  for (int k = 0; k < 24; ++k) at = at + kOut * ((TopHeight(at.x, at.z) - at.y) * 0.5);
  return at + kOut * out;
}
Double3 OnEyeball(double p, double q, double above) {
  const double r = kEyeBall + above, d = std::sqrt(std::max(r * r - p * p - q * q, 0.0));
  return kEye + kRight * p + kUp * q + kOut * d;
}

class CarBuilder {
 public:
  CarShape Build();

 private:
  static std::size_t Size(int i) { return static_cast<std::size_t>(i); }
  int Add(Double3 p) {
    shape_.points.push_back(p);
    shape_.mirror.push_back(static_cast<int>(shape_.points.size()) - 1);
    for (auto* list : {&shape_.lip, &shape_.mouth, &shape_.lid, &shape_.socket}) list->push_back(0);
    return static_cast<int>(shape_.points.size()) - 1;
  }
  int AddPair(Double3 p) {
    const int a = Add(p), b = Add(Mirrored(p));
    shape_.mirror[Size(a)] = b, shape_.mirror[Size(b)] = a;
    return a;
  }
  int& Side(int row, int column) { return sides_[Size(row)][Size((column + kColumns) % kColumns)]; }
  int& Top(int i, int j) {
    if (j == 0) return Side(kRows, i);
    if (std::abs(i) == kHalf) return Side(kRows, i > 0 ? kHalf + j : -kHalf - j);
    if (j == kBack) return Side(kRows, i >= 0 ? kColumns / 2 - i : -(kColumns / 2 + i));
    return top_[Size(i + kHalf)][Size(j)];
  }
  void Bridge(const std::vector<int>& outer, const std::vector<int>& inner) {
    for (std::size_t k = 0; k < outer.size(); ++k) {
      const std::size_t next = (k + 1) % outer.size();
      shape_.quads.push_back({outer[k], outer[next], inner[next], inner[k]});
    }
  }
  void MakeGrid();
  void MakeMouth();
  void MakeEyes();
  void PickCurves();

  CarShape shape_;
  std::vector<std::vector<int>> sides_, top_;
};

bool InMouth(int row, int i) { return row > kMouthRow0 && row < kMouthRow1 && std::abs(i) < kMouthColumn; }
bool InEye(int i, int j) {
  return std::abs(i) > kEyeColumn0 && std::abs(i) < kEyeColumn1 && j > kEyeRow0 && j < kEyeRow1;
}

void CarBuilder::MakeGrid() {
  sides_.assign(kRows + 1, std::vector<int>(kColumns, -1));
  top_.assign(2 * kHalf + 1, std::vector<int>(kBack + 1, -1));
  for (int row = 0; row <= kRows; ++row) {
    for (int column = 0; column <= kColumns / 2; ++column) {
      if (InMouth(row, column)) continue;
      Double3 p = SidePoint(column, std::max(0.0, (row - 1.0) / (kRows - 1)));
      if (row == 0) p = {p.x * 0.94, p.y + 0.5, p.z * 0.97};  // the edge's thickness
      if (row == kRows) {
        const int j = std::clamp(column - kHalf, 0, kBack);
        p = TopPoint(j == 0 ? column : j == kBack ? kColumns / 2 - column : kHalf, j);
      }
      const bool middle = column == 0 || column == kColumns / 2;
      if (middle) p.x = 0;
      Side(row, column) = middle ? Add(p) : AddPair(p);
      if (!middle) Side(row, -column) = Side(row, column) + 1;
    }
  }
  for (int j = 1; j < kBack; ++j) {
    for (int i = 0; i < kHalf; ++i) {
      if (InEye(i, j)) continue;
      Top(i, j) = i == 0 ? Add(TopPoint(0, j)) : AddPair(TopPoint(i, j));
      if (i > 0) Top(-i, j) = Top(i, j) + 1;
    }
  }
  for (int row = 0; row < kRows; ++row) {
    for (int c = -kColumns / 2; c < kColumns / 2; ++c) {
      if (row >= kMouthRow0 && row < kMouthRow1 && c >= -kMouthColumn && c < kMouthColumn) continue;
      shape_.quads.push_back({Side(row, c), Side(row, c + 1), Side(row + 1, c + 1), Side(row + 1, c)});
    }
  }
  for (int j = 0; j < kBack; ++j) {
    for (int i = -kHalf; i < kHalf; ++i) {
      const int cell = i >= 0 ? i : -i - 1;
      if (cell >= kEyeColumn0 && cell < kEyeColumn1 && j >= kEyeRow0 && j < kEyeRow1) continue;
      shape_.quads.push_back({Top(i, j), Top(i + 1, j), Top(i + 1, j + 1), Top(i, j + 1)});
    }
  }
}

void CarBuilder::MakeMouth() {
  constexpr int kAround = 2 * (2 * kMouthColumn + kMouthRow1 - kMouthRow0);  // 36
  std::vector<int> loop;
  const int middle = (kMouthRow0 + kMouthRow1) / 2;
  for (int r = middle; r < kMouthRow1; ++r) loop.push_back(Side(r, kMouthColumn));
  for (int c = kMouthColumn; c > -kMouthColumn; --c) loop.push_back(Side(kMouthRow1, c));
  for (int r = kMouthRow1; r > kMouthRow0; --r) loop.push_back(Side(r, -kMouthColumn));
  for (int c = -kMouthColumn; c < kMouthColumn; ++c) loop.push_back(Side(kMouthRow0, c));
  for (int r = kMouthRow0; r < middle; ++r) loop.push_back(Side(r, kMouthColumn));
  shape_.mouth_rings = {loop};
  struct Ring {
    double wide, high, out, share;
  };
  constexpr Ring kRings[] = {{8, 8.5, 0.5, 0.75},  {5.5, 6.5, 2.5, 0.9}, {3.0, 4.0, 5.0, 1},
                             {0.6, 1.2, 4.0, 1.1}, {0, 0, 0.5, 1.25},    {0, 1, -6, 1.5},
                             {0, 4, -14, 1.75},    {-2, 6, -26, 1.9},    {-12, 2, -34, 2}};
  shape_.lip_ring = 3;
  for (const Ring& ring : kRings) {
    std::vector<int> points(kAround);
    for (int k = 0; k < kAround; ++k) {
      if (k > kAround / 4 && k < kAround * 3 / 4) continue;
      Double3 p = AroundMouth(2 * kPi * k / kAround, ring.wide, ring.high, ring.out);
      const bool center = k == kAround / 4 || k == kAround * 3 / 4;
      if (center) p.x = 0;
      points[Size(k)] = center ? Add(p) : AddPair(p);
      if (!center) points[Size((kAround + kAround / 2 - k) % kAround)] = points[Size(k)] + 1;
    }
    for (int k = 0; k < kAround; ++k) {
      shape_.mouth[Size(points[Size(k)])] = ring.share;
      const int quarter = std::min(k % (kAround / 2), kAround / 2 - k % (kAround / 2));
      shape_.lip[Size(points[Size(k)])] =
          (k < kAround / 2 ? 1 : -1) * Smooth(-0.5, 4, quarter) * (quarter > 0 ? 1 : 0);
    }
    Bridge(shape_.mouth_rings.back(), points);
    shape_.mouth_rings.push_back(std::move(points));
  }
  const std::vector<int>& last = shape_.mouth_rings.back();
  for (int k = 0; k < kAround / 2; ++k) {
    const int a = last[Size(k)], b = last[Size(k + 1)], c = last[Size(kAround - k - 1)];
    const int d = k == 0 ? c : last[Size(kAround - k)];
    shape_.quads.push_back(b == c ? std::array<int, 4>{a, b, d, d} : std::array<int, 4>{a, b, c, d});
  }
}

void CarBuilder::MakeEyes() {
  constexpr int kAround = 24;
  std::vector<int> loop;
  const int middle = (kEyeRow0 + kEyeRow1) / 2;
  for (int j = middle; j < kEyeRow1; ++j) loop.push_back(Top(kEyeColumn1, j));
  for (int i = kEyeColumn1; i > kEyeColumn0; --i) loop.push_back(Top(i, kEyeRow1));
  for (int j = kEyeRow1; j > kEyeRow0; --j) loop.push_back(Top(kEyeColumn0, j));
  for (int i = kEyeColumn0; i < kEyeColumn1; ++i) loop.push_back(Top(i, kEyeRow0));
  for (int j = kEyeRow0; j < middle; ++j) loop.push_back(Top(kEyeColumn1, j));
  shape_.eye_rings = {loop};
  shape_.lid_ring = 5;
  constexpr double kShares[] = {0, 0, 0.08, 0.55, 1, 1};
  for (int ring = 1; ring <= 6; ++ring) {
    std::vector<int> points(kAround);
    for (int k = 0; k < kAround; ++k) {
      double sine, cosine;
      SinCos(2 * kPi * k / kAround, &sine, &cosine);
      Double3 p;
      const double edge = sine > 0 ? 11.5 : 15.5;
      if (ring == 1) p = OnWindscreen(21 * cosine, 23.5 * sine, 1.0);
      if (ring == 2) p = OnWindscreen(19.5 * cosine, 21.5 * sine, 2.2);
      if (ring == 3) p = OnEyeball(17.8 * cosine, 19.5 * sine, 0.6);
      if (ring == 4) p = OnEyeball(17.2 * cosine, (sine > 0 ? 16.0 : 18.2) * sine, 1.6);
      if (ring == 5) p = OnEyeball(16.4 * cosine, edge * sine, 1.8);
      if (ring == 6) p = OnEyeball(16.4 * cosine, (edge + 0.4) * sine, 0.3);
      const int at = points[Size(k)] = AddPair(p);
      for (int each : {at, at + 1}) {
        shape_.lid[Size(each)] = ring >= 3 ? sine : 0;
        shape_.socket[Size(each)] = kShares[ring - 1];
      }
    }
    Bridge(shape_.eye_rings.back(), points);
    // The right eye's rings run the other way round
    const std::vector<int>& outer = shape_.eye_rings.back();
    for (int k = 0; k < kAround; ++k) {
      const int next = (k + 1) % kAround;
      const auto m = [&](const std::vector<int>& list, int at) {
        return shape_.mirror[Size(list[Size(at)])];
      };
      shape_.quads.push_back({m(outer, next), m(outer, k), m(points, k), m(points, next)});
    }
    shape_.eye_rings.push_back(std::move(points));
  }
}

void CarBuilder::PickCurves() {
  const auto ring = [&](const std::vector<std::vector<int>>& rings, int which, int first, int step) {
    std::vector<int> out;
    const int n = static_cast<int>(rings[Size(which)].size());
    for (int k = 0; k < 9; ++k) out.push_back(rings[Size(which)][Size((first + step * k + 2 * n) % n)]);
    return out;
  };
  auto& curves = shape_.curves;
  curves["lipUpper"] = ring(shape_.mouth_rings, shape_.lip_ring, 17, -2);
  curves["lipLower"] = ring(shape_.mouth_rings, shape_.lip_ring, 19, 2);
  curves["lidUpper.L"] = ring(shape_.eye_rings, shape_.lid_ring, 10, -1);
  curves["lidLower.L"] = ring(shape_.eye_rings, shape_.lid_ring, 14, 1);
  for (int i = -8; i <= 8; i += 2) curves["hoodLine"].push_back(Top(i, 2));
  for (int i = -8; i <= 8; i += 2) curves["grille"].push_back(Side(kRows - 1, i));
  for (int i = 1; i <= 9; ++i) curves["brow.L"].push_back(Top(i, kEyeRow1 + 1));
  for (int k = 0; k < 9; ++k) curves["fender.L"].push_back(Side(kRows, kHalf - 2 + 3 * k));
  for (const char* name : {"lidUpper", "lidLower", "brow", "fender"}) {
    for (int point : std::vector<int>(curves[std::string(name) + ".L"]))
      curves[std::string(name) + ".R"].push_back(shape_.mirror[Size(point)]);
  }
}

CarShape CarBuilder::Build() {
  MakeGrid();
  MakeMouth();
  MakeEyes();
  PickCurves();
  return std::move(shape_);
}

// Points moved inwards, along the normals of their own mesh.
void Inset(CarCage* cage, double depth) {
  std::vector<Double3> normals(cage->points.size());
  for (const auto& q : cage->quads) {
    const auto at = [&](int k) {
      return cage->points[static_cast<std::size_t>(q[static_cast<std::size_t>(k)])];
    };
    const Double3 n = Cross(at(2) - at(0), at(3) - at(1));
    for (int i : q) normals[static_cast<std::size_t>(i)] = normals[static_cast<std::size_t>(i)] + n;
  }
  for (std::size_t i = 0; i < normals.size(); ++i)
    cage->points[i] = cage->points[i] - normals[i] * (depth / Length(normals[i]));
}

}  // namespace

Double3 Mirrored(Double3 p) { return {-p.x, p.y, p.z}; }

double Share(Double3 p, Double3 center, Double3 radius) {
  const Double3 d = {(p.x - center.x) / radius.x, (p.y - center.y) / radius.y, (p.z - center.z) / radius.z};
  const double t = Dot(d, d);
  return t >= 1 ? 0 : (1 - t) * (1 - t) * (1 + 0.9 * t);
}

CarShape MakeCarShape() { return CarBuilder().Build(); }

CarCage MuscleCage() {
  CarCage cage;
  constexpr int kAround = 12;
  constexpr std::array<double, 2> kRings[] = {{3, 4.5}, {15, 14}, {38, 23}};
  for (const auto& [wide, high] : kRings) {
    const int first = static_cast<int>(cage.points.size());
    for (int k = 0; k < kAround; ++k) {
      Double3 p = AroundMouth(2 * kPi * k / kAround, wide, high, 0);
      p.x = std::clamp(p.x, -70.0, 70.0);
      p.z = FrontDepth(p.x, p.y);
      cage.points.push_back(p);
      const int next = (k + 1) % kAround;
      if (first > 0)
        cage.quads.push_back({first + k, first + next, first - kAround + next, first - kAround + k});
    }
  }
  Inset(&cage, 9);
  return cage;
}

CarCage PanelCage() {
  CarCage cage;
  constexpr int kLines[] = {-12, -7, 0, 7, 12}, kStations[] = {1, 5, 10, 17, 20, 24, 28, 32};
  constexpr int kWide = static_cast<int>(std::size(kLines));
  for (int j : kStations) {
    for (int i : kLines) cage.points.push_back(TopPoint(i, j));
  }
  for (int a = 0; a + kWide < static_cast<int>(cage.points.size()); ++a) {
    if (a % kWide + 1 < kWide) cage.quads.push_back({a, a + 1, a + 1 + kWide, a + kWide});
  }
  Inset(&cage, 7);
  return cage;
}

namespace {

// A ring of a tube: its centre's height, half its width and height.
struct TubeRing {
  double z, y, wide, high;
};
CarCage Tube(std::span<const TubeRing> rings, int around) {
  CarCage cage;
  for (const TubeRing& ring : rings) {
    const int first = static_cast<int>(cage.points.size());
    for (int k = 0; k < around; ++k) {
      double sine, cosine;
      SinCos(2 * kPi * (k + 0.5) / around, &sine, &cosine);
      cage.points.push_back({ring.wide * cosine, ring.y + ring.high * sine, ring.z});
      const int next = (k + 1) % around;
      if (first > 0)
        cage.quads.push_back({first - around + k, first - around + next, first + next, first + k});
    }
  }
  return cage;
}

}  // namespace

CarCage FrameCage() {
  std::vector<TubeRing> rings;
  for (double z : {130.0, 87.0, 44.0, 1.0, -41.0, -83.0, -125.0}) rings.push_back({z, 58, 48, 20});
  return Tube(rings, 10);
}

CarCage ClayCage() {
  constexpr TubeRing kRings[] = {{140, 58, 50, 16},  {100, 62, 56, 20}, {60, 66, 58, 24},
                                 {20, 78, 52, 36},   {-20, 86, 50, 46}, {-60, 86, 50, 46},
                                 {-100, 74, 54, 28}, {-140, 66, 52, 20}};
  return Tube(kRings, 12);
}

}  // namespace kpsa::engine::scenes::car
