// A report's page: what its text holds, and how HTML and blobs keep it.
#include <gtest/gtest.h>
#include <zlib.h>

#include <nlohmann/json.hpp>
#include <numeric>
#include <variant>

#include "report/json_text.h"
#include "report/page_html.h"
#include "report/page_rig.h"
#include "report/page_table.h"
#include "report/viewer_page.h"
#include "tests/support/page_reader.h"

namespace kpsa::engine {
namespace {

constexpr char kViewer[] = "<html>\n<!--kpsa:data-->\n</html>\n";

std::size_t Occurrences(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(PageHtml, Base64IsThatOfTheStandard) {
  // RFC 4648, section 10, and bytes that need the last two letters
  const std::pair<const char*, const char*> kPairs[] = {{"", ""},
                                                        {"f", "Zg=="},
                                                        {"fo", "Zm8="},
                                                        {"foo", "Zm9v"},
                                                        {"foob", "Zm9vYg=="},
                                                        {"fooba", "Zm9vYmE="},
                                                        {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : kPairs) EXPECT_EQ(Base64(bytes), text);
  EXPECT_EQ(Base64("\xfb\xff\xfe"), "+//+");
  EXPECT_EQ(Base64(std::string("\0\0\0", 3)), "AAAA");
}

TEST(PageHtml, DeflatesAsBrowsersInflate) {
  std::string bytes;
  for (int i = 0; i < 100'000; ++i) bytes += static_cast<char>(i % 7 * (i / 1000));
  const std::string packed = Deflated(bytes);
  EXPECT_LT(packed.size(), bytes.size() / 10);
  EXPECT_EQ(packed.substr(0, 1), "\x78");  // RFC 1950: deflate with a window of 32 KB
  std::string plain(bytes.size(), '\0');
  uLongf size = plain.size();
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(plain.data()), &size,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  EXPECT_EQ(plain, bytes);
  EXPECT_EQ(Deflated(bytes), packed);
}

TEST(PageHtml, NamesCannotLeaveTheirElement) {
  const std::string evil = "</script><script>alert(1)</script><!-- \"\\\n";
  PageData data;
  data.Put("title", PageText(evil));
  PageTable table(evil, evil, {{evil}});
  table.Row({evil});
  data.Put("tables", "[" + table.Json() + "]");
  data.AddBlob("rest", std::span<const float>(std::vector<float>{1, 2, 3}));
  const Result<PageHtml> html = MakePageHtml(kViewer, data);
  ASSERT_TRUE(html.ok()) << html.status().ToString();
  // Two elements, of the meta and of the blob, and nothing that begins or ends another
  EXPECT_EQ(Occurrences(html->text, "<script"), 2u);
  EXPECT_EQ(Occurrences(html->text, "</script"), 2u);
  EXPECT_EQ(Occurrences(html->text, "<!--"), 0u);
  const ReadPage page = ParsePage(html->text);
  ASSERT_EQ(page.error, "");
  EXPECT_EQ(page.meta["title"], evil);
  EXPECT_EQ(page.meta["tables"][0]["rows"][0][0], evil);
  EXPECT_EQ(page.Floats("rest"), (std::vector<float>{1, 2, 3}));
}

TEST(PageHtml, KeepsTheViewerAndSaysWhatIsLarge) {
  PageData data;
  data.AddBlob("small", std::span<const std::uint8_t>(std::vector<std::uint8_t>(10, 1)));
  std::vector<std::uint8_t> noise(5000);
  std::uint32_t state = 1;
  for (std::uint8_t& byte : noise)
    byte = static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  data.AddBlob("large", std::span<const std::uint8_t>(noise));
  const Result<PageHtml> html = MakePageHtml(kViewer, data);
  ASSERT_TRUE(html.ok());
  EXPECT_TRUE(html->text.starts_with("<html>\n<script type=\"application/json\" id=\"kpsa-meta\">"));
  EXPECT_TRUE(html->text.ends_with("</script>\n</html>\n"));
  EXPECT_EQ(html->parts.front().name, "large");
  EXPECT_GT(html->parts.front().bytes, 5000u * 4 / 3);
  EXPECT_EQ(std::accumulate(html->parts.begin(), html->parts.end(), std::size_t{0},
                            [](std::size_t sum, const PageHtml::Part& part) { return sum + part.bytes; }),
            html->text.size());
  const ReadPage page = ParsePage(html->text);
  ASSERT_EQ(page.error, "");
  EXPECT_EQ(page.Wholes("large"), std::vector<int>(noise.begin(), noise.end()));
}

TEST(PageHtml, NamesTheLargestPartsOfAHeavyPage) {
  PageHtml html;
  html.text = std::string(5'000'000, 'x');
  html.parts = {
      {"basis", 3'000'000}, {"rows", 1'000'000}, {"viewer", 600'000}, {"meta", 300'000}, {"rest", 100'000}};
  EXPECT_EQ(HeavyNote(html, 5'000'000), "");
  const std::string note = HeavyNote(html, 4'999'999);
  EXPECT_NE(note.find("5 MB: basis 3 MB, rows 1 MB, viewer 600 KB, meta 300 KB, ..."), std::string::npos)
      << note;
}

TEST(PageHtml, RefusesAViewerWithoutOnePlace) {
  for (const char* viewer :
       {"<html>\n</html>\n", "<!--kpsa:data-->", "a <!--kpsa:data-->\n",
        "<html>\n<!--kpsa:data-->\n<!--kpsa:data-->\n", "<!--kpsa:data-->\n\n<!--kpsa:data-->\n"}) {
    const Result<PageHtml> html = MakePageHtml(viewer, PageData());
    EXPECT_FALSE(html.ok()) << viewer;
  }
  EXPECT_TRUE(MakePageHtml(ViewerPage(), PageData()).ok()) << "the viewer of this build";
}

TEST(PageTable, WritesNumbersTextsAndGaps) {
  PageTable table("Bench", "", {{"clip"}, {"full", "ms"}, {"why"}});
  EXPECT_TRUE(table.empty());
  table.Row({"talk", ShortCell(0.123456), {}});
  table.Row({"rest", CountCell(1234567), ShortCell(std::nan(""))});
  EXPECT_EQ(table.Json(),
            R"({"title":"Bench","columns":[{"name":"clip"},{"name":"full","unit":"ms"},{"name":"why"}],)"
            R"("rows":[["talk",0.1235,null],["rest",1234567,null]]})");
  EXPECT_EQ(std::get<double>(MillimetreCell(0.000123456)), 0.1235);
  EXPECT_EQ(std::get<double>(PercentCell(0.5)), 50);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(ShortCell(INFINITY)));
}

TEST(PageNumbers, TheSmallestAreNoErrors) {
  EXPECT_EQ((RoundedJson<nlohmann::json>(1e-310, 6)), nlohmann::json(1e-310));
  EXPECT_EQ(std::get<double>(ShortCell(-1e-310)), -1e-310);
}

}  // namespace
}  // namespace kpsa::engine
