// kpsa view: the rig in a browser, evaluated as it is moved.
#include <cstdio>
#include <memory>

#include "cli/acceleration.h"
#include "cli/frames_range.h"
#include "cli/options.h"
#include "view/server.h"

namespace kpsa::engine {
namespace {

struct ViewFlags : Flags {
  AccelerationFlags acceleration;
  std::optional<std::string> port;
};

CommandResult View(const ViewFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckAccelerationFlags(flags.acceleration, flags.acceleration.wanted()));
  const Result<int> port =
      flags.port.has_value() ? ParseCount("--port", *flags.port, 1, 65535) : Result<int>(0);
  if (!port.ok()) return port.status();
  // The page chooses what plays
  Flags rest = flags;
  rest.rest = true;
  rest.clip.reset();
  LiveOptions options;
  options.opener = OpenerOf(rest);
  options.clip = flags.clip;
  options.clips = !flags.rest;
  if (flags.acceleration.wanted()) options.acceleration = ChoiceOf(flags.acceleration);
  const Result<std::unique_ptr<Session>> session = Session::Open(std::move(options));
  if (!session.ok()) return session.status();
  const Result<std::unique_ptr<Server>> server = Server::Open(session->get(), *port);
  if (!server.ok()) return server.status();
  Print((*server)->address() + "\n");
  KPSA_RETURN_IF_ERROR(FlushOutput());
  if (!flags.quiet) {
    const LiveRig& rig = *(*session)->rig();
    for (const std::string& note : rig.rest().notes) Say("note: " + note);
    Say(fmt::format("{}: {}, {}; open the address in a browser of this machine; Ctrl-C ends it", flags.file,
                    Plural(rig.vertices(), "vertex"),
                    rig.accelerated() ? "full and accelerated" : "fully evaluated"));
  }
  // An interrupt ends the program at once: nothing of a server is half-written
  (*server)->Listen();
  return Status::Invalid("the server has ended");
}

}  // namespace

void AddViewCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<ViewFlags>();
  CLI::App* command = AddCommand(
      program, "view", "A rig in a browser, evaluated as it is moved",
      "Prints an address of this machine, and serves the page there until it is interrupted. The rig's "
      "files may be edited meanwhile.\n"
      "Examples:\n"
      "  kpsa view head.glb\n"
      "  kpsa view head.yaml --accelerate\n"
      "  kpsa view head.yaml --kpsa head.kpsa --tolerance 0.2mm --port 8000",
      chosen, [flags] { return View(*flags); });
  AddRigFlags(command, flags.get());
  AddAccelerationFlags(command, &flags->acceleration);
  AddOption(command, "--port", "N", &flags->port, "the port of 127.0.0.1; any free one if not given");
  AddQuietFlag(command, flags.get());
}

}  // namespace kpsa::engine
