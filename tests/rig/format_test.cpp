// The canonical form of rig files.
#include "rig/file/format.h"

#include <algorithm>
#include <filesystem>

#include "tests/rig/rig_fixture.h"

namespace kpsa::engine {
namespace {

std::string Formatted(const std::string& text) {
  const Result<YamlNode> root = ParseYaml(text, "t.yaml");
  EXPECT_TRUE(root.ok()) << root.status().ToString();
  if (!root.ok()) return "";
  const Result<std::string> formatted = FormatRig(*root, StandardRegistry());
  return formatted.ok() ? *formatted : formatted.status().ToString();
}

// Everything that a graph holds.
std::string TextOf(const Graph& graph) {
  std::string text;
  for (const NodeId node : graph.Nodes()) {
    text += graph.name(node) + " " + graph.def(node).name + "\n";
    for (std::size_t a = 0; a < graph.def(node).attributes.size(); ++a) {
      for (const SetValue& set : graph.Values(node, static_cast<int>(a)))
        text += graph.PlugName(set.plug) + "=" + set.value.digest().ToHex() + "\n";
    }
    for (const Connection& c : graph.Inputs(node))
      text += graph.PlugName(c.source) + ">" + graph.PlugName(c.destination) + "\n";
  }
  return text;
}

TEST(RigFormat, IsOneWayOfWriting) {
  EXPECT_EQ(Formatted(R"(overrides:
    mush.iterations: 12
nodes:
    'mush':
        type: deltaMush
        iterations: 010.50
        smoothingStep: 0.50   # half
    "w": {"type": wire, "weights": "w/lips.json#upper", dropoff: 2.0cm, curve: "1.0"}
connections: ["a.x -> b.cv[1]", {from: c.x, to: "d.weight[open]", override: on}]
units:
    length: cm
controls: {"m.weight[a]": {min: 0.0, max: +1}}
fps: 24.0
character: 'c.glb'
kpsa: 1
)"),
            R"(kpsa: 1
units: {length: cm}
fps: 24
character: c.glb
nodes:
  mush: {type: deltaMush, iterations: 010.50, smoothingStep: 0.5}
  w: {type: wire, weights: w/lips.json#upper, dropoff: 2.0cm, curve: "1.0"}

connections:
  - a.x -> b.cv[1]
  - {from: c.x, to: "d.weight[open]", override: on}

controls:
  m.weight[a]: {min: 0, max: 1}

overrides:
  mush.iterations: 12
)");
}

TEST(RigFormat, LongEntriesAreBroken) {
  std::string vertices, meshes;
  for (int i = 0; i < 90; ++i) vertices += fmt::format("{}{}", i == 0 ? "" : ", ", 1000 + i);
  for (int i = 0; i < 12; ++i) meshes += fmt::format("a_mesh_of_the_character_{}, ", i);
  const std::string text = Formatted("kpsa: 1\nnodes: {c: {type: curve, vertices: [" + vertices +
                                     "]}}\ndeform: [{meshes: [" + meshes + "x], stack: [skin, m]}]\n");
  EXPECT_TRUE(Has(text, "  c:\n    type: curve\n    vertices: [1000, 1001,")) << text;
  EXPECT_TRUE(Has(text, "  - meshes: [a_mesh_of_the_character_0,")) << text;
  for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    EXPECT_LE(end - begin, 150u);
  EXPECT_EQ(Formatted(text), text);
}

TEST(RigFormat, HostileStringsStayWhatTheyAre) {
  const std::vector<std::string> strings = {"no",
                                            "010",
                                            "1e3",
                                            "~",
                                            "",
                                            "null",
                                            "True",
                                            "0x1F",
                                            "1_000",
                                            "12:30",
                                            "2001-12-14",
                                            ".inf",
                                            ".5",
                                            "<<",
                                            "=",
                                            "-",
                                            "- a",
                                            "-5",
                                            "--- a",
                                            "...",
                                            "a: b",
                                            "a:",
                                            ":a",
                                            "a #b",
                                            "#a",
                                            " a",
                                            "a ",
                                            "a,b",
                                            "[a]",
                                            "{a}",
                                            "a]b",
                                            "&a",
                                            "*a",
                                            "!a",
                                            "|",
                                            ">",
                                            "'a'",
                                            "\"a\"",
                                            "a'b",
                                            "a\"b",
                                            "a\\b",
                                            "%a",
                                            "@a",
                                            "`a",
                                            "? a",
                                            "a?",
                                            "$(s)",
                                            "w/l.json#u",
                                            "hero:arm:ik.target",
                                            "a\tb",
                                            "a\nb",
                                            "line \n\n two",
                                            "\xC3\xA9t\xC3\xA9",
                                            "\xE2\x80\xA8",
                                            "a -> b",
                                            "m.weight[open]",
                                            "y",
                                            "Off",
                                            "1%",
                                            "0.2mm",
                                            "+1",
                                            "\\n"};
  for (const std::string& string : strings) {
    YamlNode root, nodes, node, key, value;
    for (YamlNode* map : {&root, &nodes, &node}) map->kind = YamlNode::Kind::kMap;
    key.kind = value.kind = YamlNode::Kind::kScalar;
    value.scalar = string;
    value.quoted = true;
    const auto add = [&](YamlNode* to, const std::string& name, const YamlNode& item) {
      key.scalar = name, key.quoted = true;
      to->keys.push_back(key);
      to->items.push_back(item);
    };
    add(&node, string, value);
    YamlNode list;
    list.kind = YamlNode::Kind::kSequence;
    list.items = {value, value};
    add(&node, "list", list);
    add(&nodes, "n", node);
    add(&root, "kpsa", value);
    add(&root, "nodes", nodes);
    add(&root, "connections", list);
    const Result<std::string> text = FormatRig(root, StandardRegistry());
    ASSERT_TRUE(text.ok()) << string << ": " << text.status().ToString();
    const Result<YamlNode> back = ParseYaml(*text, "");
    ASSERT_TRUE(back.ok()) << *text;
    const YamlNode& read = back->Find("nodes")->items[0];
    EXPECT_TRUE(read.items[0].is_scalar()) << *text;
    EXPECT_EQ(read.items[0].scalar, string) << *text;
    EXPECT_EQ(read.keys[0].scalar, string) << *text;
    EXPECT_EQ(back->Find("connections")->items[1].scalar, string) << *text;
    EXPECT_EQ(*FormatRig(*back, StandardRegistry()), *text);
  }
  // What reads as another type keeps its quotes, and needs none otherwise
  const std::string text = Formatted("kpsa: 1\nvariants: {v: {a: 'no', b: no, c: '7', d: 7, e: 'seven'}}\n");
  EXPECT_TRUE(Has(text, "v: {a: \"no\", b: no, c: \"7\", d: 7, e: seven}")) << text;
  EXPECT_TRUE(Has(Formatted("kpsa: 1\nnodes: {a: !!str 1}\n"), "t.yaml: has YAML tags"));
}

TEST(RigFormat, FindsComments) {
  for (const char* text :
       {"# a", "a: b # c", "a: 'it''s' # c", "a:\n#c\n", "a: \"\\\"\" # c", "{a.b: x-'} # c", "{a: x:'b} # c",
        "a: x-' # c", "a: x,' # c", "a: [x, y'] # c", "- ' ' # c", "a: b'\nc: 'd' # e", "{\"a\":'b'} # c"})
    EXPECT_TRUE(HasComments(text)) << text;
  for (const char* text :
       {"a: b#c", "a: 'b # c'", "a: \"b \\\" # c\"", "{a: '# b', \"# c\": 1}", "", "- '# a'", "{\"a\":'# b'}",
        "a: [x,'# b']", "a: &n '# b'", "? '# a'\n: '# b'", "a: x#"})
    EXPECT_FALSE(HasComments(text)) << text;
}

// In texts over several lines, and where only the reader of YAML knows what is one.
TEST(RigFormat, FindsCommentsBesideLongTexts) {
  for (const char* text :
       {"a: x\n  'tis # gone\n", "a: |\n  'tis\nb: 1 # gone\n", "a: | # b\n  c\n", "a: |\n   b\n # c\n",
        "- >-\n  \"b\n- c # d", "a: 'b\n  # c' # d", "a: b\n#", "# a\n--- # b\na: b\n"})
    EXPECT_TRUE(HasComments(text)) << text;
  for (const char* text :
       {"%A # b\n---\na: b\n", "[a,#b\n c]", "a: \"\\x23\" # b", "a: &b 'c' # d\ne: *b", "a: b\n... # c\n"})
    EXPECT_TRUE(HasComments(text)) << text;
  for (const char* text :
       {"a: x\n  y#\n  'tis#", "a: |\n  'tis\n  # b\nc: 1", "a: >2\n   # b\n\n  # c\n",
        "- - |\n    # a\n- '\n  # b'", "a: \"b\n  # c\"", "a: \"\\x23 #\"", "a: &b '# c'\nd: *b", "a: _#"})
    EXPECT_FALSE(HasComments(text)) << text;
}

std::string WithComments(const std::string& text) {
  const Result<YamlNode> root = ParseYaml(text, "t.yaml");
  const std::optional<std::vector<Comment>> comments = FindComments(text);
  EXPECT_TRUE(root.ok() && comments.has_value()) << text;
  if (!root.ok() || !comments.has_value()) return "";
  const Result<std::string> formatted =
      FormatRig(*root, StandardRegistry(), AttachComments(*root, text, *comments));
  return formatted.ok() ? *formatted : formatted.status().ToString();
}

std::vector<std::string> CommentTexts(const std::string& text) {
  std::vector<std::string> texts;
  const std::optional<std::vector<Comment>> comments = FindComments(text);
  EXPECT_TRUE(comments.has_value());
  for (const Comment& c : comments.value_or(std::vector<Comment>())) texts.push_back(c.text);
  std::sort(texts.begin(), texts.end());
  return texts;
}

TEST(RigFormat, CommentsStayWithTheirEntries) {
  const std::string text = R"(# The head of the file,
# in two lines

# what is set
overrides: {mush.iterations: 12}  # smoother
nodes:
    # about mush
    mush:
        type: deltaMush   # a type
        # half a step
        smoothingStep: 0.50
        # the end of mush
    # about w
    "w": {type: wire, curve: "a # b"} # beside w
connections:
  - a.x -> b.y
    # of the list
fps: 24   # film
kpsa: 1
# the foot
)";
  const std::string formatted = WithComments(text);
  EXPECT_EQ(formatted, R"(# The head of the file,
# in two lines

kpsa: 1
fps: 24 # film
nodes:
  # about mush
  # a type
  # half a step
  # the end of mush
  mush: {type: deltaMush, smoothingStep: 0.5}
  # about w
  w: {type: wire, curve: "a # b"} # beside w

connections:
  - a.x -> b.y
  # of the list

# what is set
overrides: # smoother
  mush.iterations: 12
# the foot
)");
  EXPECT_EQ(WithComments(formatted), formatted);
}

// What a file says, whatever the order of its keys and the spelling of its numbers.
std::string Meaning(const YamlNode& node) {
  std::vector<std::string> parts;
  if (node.is_scalar()) {
    const Result<double> number = ParseQuantity(node.scalar, Unit::kNone, FileUnits());
    return number.ok() && !node.quoted ? fmt::format("{}", *number) : "'" + node.scalar + "'";
  }
  for (std::size_t i = 0; i < node.items.size(); ++i)
    parts.push_back((node.is_map() ? node.keys[i].scalar + ": " : "") + Meaning(node.items[i]));
  if (node.is_map()) std::sort(parts.begin(), parts.end());
  const std::string all = fmt::format("{}", fmt::join(parts, ", "));
  return node.is_map() ? "{" + all + "}" : "[" + all + "]";
}

// All rigs of this repository say the same afterwards, and those that load at once are the same graphs.
TEST(RigFormat, KeepsTheRepositorysRigs) {
  namespace fs = std::filesystem;
  const fs::path source(KPSA_SOURCE_DIR);
  std::size_t files = 0, loaded = 0;
  for (const char* folder : {"scenes", "tests/rigs"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(source / folder)) {
      if (entry.path().extension() != ".yaml") continue;
      const std::string text = TemporaryFolder::Read(entry.path().string());
      const std::string formatted = Formatted(text);
      const Result<YamlNode> said = ParseYaml(text, ""), says = ParseYaml(formatted, "");
      ASSERT_TRUE(said.ok() && says.ok()) << formatted;
      EXPECT_EQ(Meaning(*said), Meaning(*says)) << entry.path();
      EXPECT_EQ(Formatted(formatted), formatted) << entry.path();
      EXPECT_TRUE(HasComments(text) && !HasComments(formatted)) << entry.path();
      const std::string commented = WithComments(text);
      EXPECT_EQ(CommentTexts(text), CommentTexts(commented)) << entry.path();
      EXPECT_EQ(WithComments(commented), commented) << entry.path();
      ++files;
      const std::string name = entry.path().filename().string();
      const bool of_nodes = entry.path().parent_path().filename() == "nodes";
      if (name != "hello.yaml" && name != "gi.yaml" && !of_nodes) continue;
      const TemporaryFolder copy;
      for (const fs::directory_entry& other : fs::directory_iterator(entry.path().parent_path()))
        fs::copy(other.path(), fs::path(copy.path()) / other.path().filename());
      const auto load = [&](std::string rig) {
        const std::string outside = "../../../";
        if (const std::size_t at = rig.find(outside); at != std::string::npos)
          rig.replace(at, outside.size(), KPSA_SOURCE_DIR "/");
        return LoadRig(StandardRegistry(), copy.Write(name, rig));
      };
      const Result<Rig> before = load(text), after = load(formatted);
      ASSERT_TRUE(before.ok()) << before.status().ToString();
      ASSERT_TRUE(after.ok()) << after.status().ToString();
      EXPECT_EQ(TextOf(*before->graph), TextOf(*after->graph));
      EXPECT_EQ(before->controls.size(), after->controls.size());
      ++loaded;
    }
  }
  EXPECT_GE(files, 23u);
  EXPECT_EQ(loaded, 8u);
}

}  // namespace
}  // namespace kpsa::engine
