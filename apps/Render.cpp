// vdi render: renders a VDI from new viewpoints, as PNG.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <poll.h>

#include <filesystem>
#include <optional>
#include <set>

#include "apps/Cameras.h"
#include "apps/Commands.h"
#include "apps/FolderWatch.h"
#include "apps/Movie.h"
#include "apps/OutputFiles.h"
#include "apps/Say.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi::apps {

namespace {

struct RenderOptions {
  std::string input;
  std::string output;
  CameraOptions camera;
  std::vector<double> azimuths{0.0};
  int orbit = 0;       // pictures of a turn; 0: none
  std::string movie;   // file for the turn's movie; empty: none
  double rate = 30.0;  // pictures of the movie per second
  double elevation = 0.0;
  std::string resolution;
  std::string reconstruction = toString(defaultReconstruction);
  std::vector<double> clip;  // 6 for each plane
  bool follows = false;      // `input` is a folder
  std::uint64_t frames = 0;  // number of VDIs to render if `follows`; 0: no end
};

/// One of the pictures to render.
struct Pose {
  double azimuth = 0.0;
  std::filesystem::path path;  // empty: only for the movie
};

/// With several azimuths, the degrees become part of the pictures' names, and in an orbit their numbers.
std::vector<Pose> posesOf(const RenderOptions& options) {
  constexpr double turn = 360.0;
  std::vector<Pose> poses;
  poses.reserve(static_cast<std::size_t>(std::max(options.orbit, 0)));
  for (int i = 0; i < options.orbit; ++i) {
    poses.push_back({options.azimuths.front() + turn * i / options.orbit,
                     options.output.empty() ? "" : withSuffix(options.output, fmt::format("{:04}", i))});
  }
  if (options.orbit > 0) return poses;
  for (const double azimuth : options.azimuths) {
    poses.push_back({azimuth, options.azimuths.size() == 1
                                  ? std::filesystem::path(options.output)
                                  : withSuffix(options.output, fmt::format("{:g}deg", azimuth))});
  }
  return poses;
}

void requirePictures(const RenderOptions& options) {
  std::vector<NamedFile> outputs;
  for (const Pose& shot : posesOf(options)) {
    if (!shot.path.empty())
      outputs.push_back({fmt::format("the picture at {} degrees", shot.azimuth), shot.path});
  }
  if (!options.movie.empty()) outputs.push_back({"--movie", options.movie});
  requireOutputs(outputs, {{"the VDI", options.input}, {"--camera", options.camera.file}});
}

/// Renders VDIs, one after the other, to the same pictures.
class Painter {
 public:
  explicit Painter(const RenderOptions& options)
      : options_(options),
        reconstruction_(reconstructionFromString(options.reconstruction)),
        poses_(posesOf(options)),
        renderer_(gpu::Device::create(gpu::requestFromEnvironment(0))) {
    renderer_.setClipPlanes(makeClipPlanes(options.clip));
  }

  void paint(const Vdi& vdi) {
    const glm::ivec2 picture = vdi.pictureSize();
    const std::vector<int> size = options_.resolution.empty() ? std::vector<int>{picture.x, picture.y}
                                                              : parseSizes(options_.resolution, 2);
    renderer_.setVdi(vdi);
    const Camera start = chosenCamera(options_.camera, vdi.camera);
    std::optional<Movie> movie;
    if (!options_.movie.empty()) movie.emplace(options_.movie, size[0], size[1], options_.rate);
    for (const auto& [azimuth, path] : poses_) {
      const Camera camera = turned(start, azimuth, options_.elevation);
      const auto issue = viewpointIssue(vdi.bounds, vdi.view(), View(camera, size[0], size[1]));
      if (issue && warned_.insert(*issue).second)
        say(fmt::format("warning: at {} degrees: {}", azimuth, describe(*issue)));
      const io::Picture made = io::toPicture(
          renderer_.renderBytes(camera, size[0], size[1], Alpha::Premultiplied, reconstruction_));
      if (movie) movie->add(made);
      if (path.empty()) continue;
      io::writePng(path, made);
      fmt::print("{}: {:.2f} ms on the device\n", printable(path.string()), renderer_.renderMilliseconds());
    }
    if (!movie) return;
    movie->finish();
    fmt::print("{}: {} pictures\n", printable(options_.movie), poses_.size());
  }

 private:
  const RenderOptions& options_;
  Reconstruction reconstruction_;
  std::vector<Pose> poses_;
  VdiRenderer renderer_;
  std::set<ViewpointIssue> warned_;
};

/// Waits for changes of a folder, whose file system may not report them.
void awaitChange(const FolderWatch& watch) {
  pollfd descriptor{watch.descriptor(), POLLIN, 0};
  (void)::poll(&descriptor, 1, static_cast<int>(watch.untilListing().count()));
}

/// The last complete VDI of some files. The watch reports an incomplete file again when it changes.
std::optional<Vdi> newestOf(const std::vector<std::filesystem::path>& files) {
  for (auto file = files.rbegin(); file != files.rend(); ++file) {
    try {
      Vdi vdi = io::readVdi(*file);
      fmt::print("{}\n", printable(file->string()));
      return vdi;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::Io && error.code() != ErrorCode::Format &&
          error.code() != ErrorCode::OutOfMemory)
        throw;
      say(fmt::format("{}; skipped for now", error.what()));
    }
  }
  return std::nullopt;
}

/// Keeps the pictures up to date with the newest VDI of a folder.
void follow(const RenderOptions& options) {
  FolderWatch watch(options.input);
  Painter painter(options);
  for (std::uint64_t done = 0; options.frames == 0 || done < options.frames;) {
    const std::optional<Vdi> newest = newestOf(watch.changed().files);
    if (newest) {
      painter.paint(*newest);
      ++done;
      (void)std::fflush(stdout);  // other programs may read the output
    } else {
      awaitChange(watch);
    }
  }
}

void render(const RenderOptions& options) {
  requirePictures(options);
  if (options.follows) {
    follow(options);
  } else {
    Painter(options).paint(io::readVdi(options.input));
  }
}

}  // namespace

void addRender(CLI::App& app, Job& job) {
  constexpr int mostPictures = 9999;
  CLI::App* command = app.add_subcommand("render", "Render a VDI from new viewpoints to PNG");
  command->footer(
      "Example:\n"
      "  vdi render coil.vdi -o coil.png --azimuth 0 5 20 50\n"
      "writes coil_0deg.png, coil_5deg.png, coil_20deg.png and coil_50deg.png.\n"
      "  vdi render --follow results/ -o now.png\n"
      "keeps a picture of the newest VDI in results/ while a simulation writes there.\n"
      "  vdi render coil.vdi --orbit 240 --movie coil.webm\n"
      "makes a movie of one turn with the program ffmpeg.");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("input", options->input, "the .vdi file; with --follow, a folder")
      ->type_name("")
      ->required();
  CLI::Option* const output =
      command
          ->add_option(
              "-o,--output", options->output,
              "PNG; with several azimuths, the degrees become part of its name, with --orbit a number")
          ->type_name("FILE");
  command
      ->add_option("--resolution", options->resolution, "size in pixels; default: that of the VDI's picture")
      ->type_name("WxH");
  addCameraOptions(*command, options->camera, "the one with which the VDI was made");
  command
      ->add_option("--azimuth", options->azimuths,
                   "degrees by which to turn the camera about its focal point, around the given view-up "
                   "(vtkCamera's Azimuth); several azimuths make several pictures")
      ->type_name("DEG")
      ->capture_default_str()
      ->group("Viewpoint");
  command->add_option("--elevation", options->elevation, "degrees by which to raise the camera afterwards")
      ->capture_default_str()
      ->group("Viewpoint");
  CLI::Option* const orbit = command
                                 ->add_option("--orbit", options->orbit,
                                              "number of pictures of a whole turn, which begins at --azimuth")
                                 ->check(CLI::Range(1, mostPictures))
                                 ->type_name("N")
                                 ->group("Viewpoint");
  CLI::Option* const movie =
      command
          ->add_option(
              "--movie", options->movie,
              std::string(
                  "with --orbit: also, or in place of -o, a movie made by ffmpeg, whose name ends in ") +
                  movieExtensions)
          ->type_name("FILE")
          ->needs(orbit);
  command->add_option("--rate", options->rate, "with --movie: pictures per second")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str()
      ->needs(movie);
  addReconstructionOption(*command, options->reconstruction);
  addClipOption(*command, options->clip, "Viewpoint");
  CLI::Option* follows =
      command
          ->add_flag("--follow", options->follows,
                     "render the newest VDI of a folder whenever a file appears, until Ctrl+C")
          ->excludes(orbit);
  command
      ->add_option("--frames", options->frames,
                   "with --follow: number of VDIs after which to end; default: 0, never")
      ->needs(follows);
  command->callback([options, output, movie, &job] {
    if (output->count() == 0 && movie->count() == 0)
      throw CLI::RequiredError("--output, or --orbit with --movie");
    if (options->orbit > 0 && options->azimuths.size() != 1)
      throw CLI::ValidationError("--orbit", "takes one --azimuth, at which it begins");
    if (movie->count() > 0 && !isMovie(options->movie))
      throw CLI::ValidationError("--movie", std::string("the name must end in ") + movieExtensions);
    job = {[options](const comm::Communicator&) { render(*options); }};
  });
}

}  // namespace vdi::apps
