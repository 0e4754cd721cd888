// kpsa nodes: the node reference, from the registry.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "picture/node_pictures.h"
#include "report/node_reference.h"
#include "report/rig_schema.h"
#include "rig/build/type_names.h"

namespace kpsa::engine {
namespace {

struct NodesFlags : Flags {
  std::optional<std::string> type;
  std::optional<std::string> pictures;
  bool markdown = false, schema = false;
};

CommandResult Nodes(const NodesFlags& flags) {
  NodeRegistry registry;
  AddAllNodes(registry);
  PluginLoader plugins(&registry);
  KPSA_RETURN_IF_ERROR(LoadPlugins(flags, &plugins));
  if (flags.markdown + flags.schema + flags.json + flags.pictures.has_value() > 1)
    return Status::Usage("expected one of --markdown, --pictures, --schema and --json");
  if (flags.pictures.has_value()) {
    if (flags.type.has_value())
      return Status::Usage("--pictures is of all node types, expected no TYPE, found \"{}\"", *flags.type);
    KPSA_RETURN_IF_ERROR(WriteNodePictures(registry, *flags.pictures, flags.force));
    return 0;
  }
  if (flags.schema) {
    if (flags.type.has_value())
      return Status::Usage("--schema is of all node types, expected no TYPE, found \"{}\"", *flags.type);
    Print(RigSchema(registry));
    return 0;
  }
  std::vector<const NodeDef*> defs;
  for (const std::string& name : registry.Names()) defs.push_back(registry.Find(name));
  if (flags.type.has_value()) {
    const NodeDef* def = registry.Find(*flags.type);
    if (def == nullptr)
      return Status::Usage("no node type is called \"{}\"{}", *flags.type,
                           SuggestType(*flags.type, registry));
    defs = {def};
  }
  if (flags.json) {
    Print(NodesJson(defs));
  } else if (flags.markdown) {
    Print(NodesMarkdown(defs, HasNodePicture));
  } else {
    Print(flags.type.has_value() ? NodeText(*defs[0]) : NodesText(defs));
  }
  return 0;
}

}  // namespace

void AddNodesCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<NodesFlags>();
  CLI::App* command = AddCommand(program, "nodes", "The node reference",
                                 "Examples:\n"
                                 "  kpsa nodes\n"
                                 "  kpsa nodes deltaMush\n"
                                 "  kpsa nodes --plugin libmynodes.so --json\n"
                                 "  kpsa nodes --schema > rig.schema.json",
                                 chosen, [flags] { return Nodes(*flags); });
  AddOption(command, "TYPE", "", &flags->type, "one node type, with its attributes");
  AddSwitch(command, "--markdown", &flags->markdown, "print the whole reference as Markdown");
  AddOption(command, "--pictures", "FOLDER", &flags->pictures,
            "write a picture of what each deformer does, FOLDER/TYPE.png");
  AddSwitch(command, "--force", &flags->force, "replace existing pictures");
  AddSwitch(command, "--schema", &flags->schema, "print a JSON Schema of rig files, for editors");
  AddPluginFlags(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
