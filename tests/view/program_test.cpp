// The real program, run as a person runs it.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "gl_test.h"
#include "reading/place.h"
#include "support/rasters/analytic_archive.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using Outcome = test::RunResult;

class ViewProgramTest : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    test::write_analytic_archive(path("good.isohf"), grid());
  }
  static TileGrid grid() { return TileGrid::make(TileShape::make(36, 43, 3), 3, 2, 320.0, 320.0); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string text(const std::string& name) const { return test::read_file(path(name)); }
  [[nodiscard]] static Outcome run(const std::string& arguments, const std::string& before = "") {
    return test::run_program({"/bin/sh", "-c", before + " '" ISOHF_BIN_DIR "/isohf-view' " + arguments});
  }
  [[nodiscard]] bool is_png(const std::string& name) const { return text(name).substr(1, 3) == "PNG"; }

  static bool has_display() {
    return std::system("command -v xvfb-run >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1") == 0;
  }
  /// Opens a window on a display of its own, with its folder as the working directory, takes `steps` there and presses
  /// Escape; returns what --json prints. Steps are lines for sh: $id is the window, $viewer the process.
  nlohmann::json in_window(const std::string& arguments, const std::string& steps, const std::string& folder = "") {
    test::write_file(path("window.sh"), R"sh(
      cd "$2"
      )sh"
                                        "'" ISOHF_BIN_DIR "/isohf-view' " +
                                            arguments +
                                            R"sh( --json --size 320x240 >"$1/window.json" 2>"$1/window.err" & viewer=$!
      id=$(timeout 30 xdotool search --sync --onlyvisible --name isohf-view | head -1)
      xdotool windowmove "$id" 0 0 windowfocus "$id" sleep 1
      )sh" + steps + R"sh(
      xdotool key Escape
      wait $viewer
    )sh");
    const Outcome outcome = test::run_program({"/usr/bin/env", "xvfb-run", "-a", "-s", "-screen 0 400x300x24", "sh",
                                               path("window.sh"), path(""), folder.empty() ? path("") : folder});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err << text("window.err");
    return nlohmann::json::parse(text("window.json"), nullptr, false);
  }

 private:
  const test::TemporaryFolder folder_;
};

TEST_F(ViewProgramTest, WritesScreenshots) {
  for (const std::string mode : {"elevation", "levels", "strips", "normals"}) {
    const Outcome outcome =
        run(path("good.isohf") + " --size 320x200 --wireframe --mode " + mode +
            " --sun 90,12 --position 480,300,900 --look-at 480,0,300 --screenshot " + path(mode + ".png"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_TRUE(is_png(mode + ".png")) << mode;
  }
}

/// Along the body, not along the map, which is true on two parallels at most.
TEST_F(ViewProgramTest, MeasuresAlongTheBody) {
  std::string samples;
  for (int i = 0; i < 360 * 180; ++i) samples += std::string("\0\0\x20\x41", 4);  // 10.0F
  test::write_file(path("globe.flt"), samples);
  test::write_file(path("globe.hdr"),
                   "ncols 360\nnrows 180\nxllcorner -180\nyllcorner -90\ncellsize 1\nbyteorder LSBFIRST\n");
  test::write_file(
      path("globe.prj"),
      R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["Degree",0.0174532925199433]])");
  ASSERT_EQ(test::run_program({ISOHF_BIN_DIR "/isohf", "convert", path("globe.flt"), "-o", path("globe.isohf"), "-q"})
                .exit_code,
            0);
  const double degree = 6378137.0 * std::acos(-1.0) / 180.0;  // along the map, which is true on the equator
  const auto globe = view::open_archive(path("globe.isohf"));
  const auto length = [&](double x0, double x1, double z) {
    return view::distance_between(*globe, {x0 * degree, z * degree}, {x1 * degree, z * degree});
  };
  EXPECT_NEAR(length(180.0, 190.0, 90.0), 10.0 * degree, 2000.0);
  // A quarter of the parallel of 60 degrees North, by the great circle: 41.41 degrees of it.
  EXPECT_NEAR(length(180.0, 270.0, 30.0), 41.41 * degree, 0.01 * 41.41 * degree);
}

TEST_F(ViewProgramTest, VerifiesGoodAndBadArchives) {
  const Outcome good = run(path("good.isohf") + " --verify");
  EXPECT_EQ(good.exit_code, 0) << good.out << good.err;
  EXPECT_EQ(good.err, "");
  EXPECT_NE(good.out.find("agree"), std::string::npos);

  test::write_analytic_archive(path("bad.isohf"), grid(), [](TileIndex tile, std::vector<std::uint16_t>& codes) {
    if (tile == TileIndex{1, 1}) std::rotate(codes.begin(), codes.begin() + 1, codes.end());
  });
  const Outcome bad = run(path("bad.isohf") + " --verify");
  EXPECT_EQ(bad.exit_code, 3) << bad.err;
  EXPECT_NE(bad.out.find("shared vertices: tile (1,1)"), std::string::npos) << bad.out;

  const Outcome part = run(path("bad.isohf") + " --verify --tiles 2:3,0:1 --json");
  EXPECT_EQ(nlohmann::json::parse(part.out).at("tiles"), 1) << part.out;
  EXPECT_EQ(run(path("bad.isohf") + " --verify --tiles 1:3,1:2").exit_code, 3);
}

TEST_F(ViewProgramTest, DrawsArchivesThatAreVoidOrOneTile) {
  test::write_analytic_archive(path("void.isohf"), grid(), [](TileIndex, std::vector<std::uint16_t>& codes) {
    std::fill(codes.begin(), codes.end(), std::uint16_t{65535});
  });
  test::write_analytic_archive(path("one.isohf"), TileGrid::make(TileShape::make(5, 5, 1), 1, 1, 10.0, 10.0));
  for (const std::string archive : {"void.isohf", "one.isohf"}) {
    for (const std::string& action : {"--screenshot " + path("a.png"), std::string("--verify")}) {
      const Outcome outcome = run(path(archive) + " --size 100x80 --overwrite " + action);
      EXPECT_EQ(outcome.exit_code, 0) << archive << " " << action << "\n" << outcome.out << outcome.err;
      EXPECT_EQ(outcome.err, "") << archive << " " << action;
      EXPECT_EQ(outcome.out.find("nan"), std::string::npos) << outcome.out;
      EXPECT_EQ(outcome.out.find("inf"), std::string::npos) << outcome.out;
    }
  }
}

TEST_F(ViewProgramTest, GrowsNoMoreThanItsMemoryBound) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer keeps freed memory for a while";
#endif
  const TileGrid wide = TileGrid::make(TileShape::make(68, 83, 4), 50, 40, 640.0, 640.0);
  test::write_analytic_archive(path("wide.isohf"), wide);
  const auto peak_mib = [&](const std::string& memory) {
    // Looking up: what the driver takes for triangles would hide what tiles take.
    const std::string command =
        "exec '" ISOHF_BIN_DIR "/isohf-view' " + path("wide.isohf") +
        " -q --overwrite --size 64x48 --far 12000 --position 16000,200,12800 --look-at 16001,99000,12800 --memory " +
        memory + " --screenshot " + path("up.png");
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      ::_exit(127);
    }
    int status = -1;
    rusage usage{};
    EXPECT_EQ(::wait4(child, &status, 0, &usage), child);
    EXPECT_EQ(status, 0);
    return static_cast<double>(usage.ru_maxrss) / 1024.0;
  };
  const double grown = peak_mib("34M") - peak_mib("2M");
  // Half of the bound is put to use at least, the rest is for tiles on their way; a tenth is the allocator's rounding.
  EXPECT_GT(grown, 0.4 * 32.0);
  EXPECT_LT(grown, 1.1 * 32.0 + 1.0);
}

TEST_F(ViewProgramTest, RefusesInOneLine) {
  test::write_file(path("text.isohf"), "this is no archive\n");
  const std::string good = path("good.isohf");
  const std::string shot = " --screenshot " + path("no.png");
  struct Case {
    std::string arguments;
    int exit_code;
    std::string message;
    std::string before = "";
  };
  for (const Case& one : std::vector<Case>{
           {path("text.isohf") + " --verify", 1, "text.isohf"},
           {good + " --verify", 1, "OpenGL 3.3", "MESA_GL_VERSION_OVERRIDE=2.1"},
           {good, 1, "; --screenshot PICTURE.png draws without one\n", "env -u DISPLAY -u WAYLAND_DISPLAY"},
           {"", 2, "isohf-view: no ARCHIVE given"},
           {good + " --verfy", 2, "isohf-view: unknown option --verfy; did you mean --verify?"},
           {good + " --verify --tiles 2:4,0:1", 2, "--tiles: the archive has 3 by 2 tiles"},
           {good + " --tiles 2:3,0:1", 2, "--tiles requires --verify"},
           {good + " --level 9" + shot, 2, "--level 9: "},
           {good + " --sun 3" + shot, 2, "--sun: found '3', must be AZ,EL"},
           {good + " --date 2026-06-21" + shot, 2, "--date: "},
           {good + " --time 12:00" + shot, 2, "--time requires --date"},
           {good + " --sun 1,2 --date 2026-06-21" + shot, 2, "--sun excludes --date"},
           {good + " --size 64x48 --legend" + shot, 2, "--legend needs pictures of at least"},
           {good + " --legend --verify", 2, "--legend requires --screenshot"},
           {good + " --palette pink" + shot, 2, "--palette: "}}) {
    SCOPED_TRACE(one.before + " " + one.arguments);
    const Outcome outcome = run(one.arguments, one.before);
    EXPECT_EQ(outcome.exit_code, one.exit_code);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(one.message), std::string::npos) << outcome.err;
  }
}

TEST_F(ViewProgramTest, HelpAndVersionAreThoseOfEveryCommand) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Usage: isohf-view ARCHIVE [OPTIONS]\n"), std::string::npos);
  EXPECT_NE(help.out.find("\nOptions of every command:\n"), std::string::npos);
  EXPECT_EQ(run("-V").out.rfind("isohf-view ", 0), 0U);
}

TEST_F(ViewProgramTest, ReplacesFilesOnlyWhenTold) {
  const std::string shot = path("good.isohf") + " --size 64x48 --screenshot " + path("kept.png");
  test::write_file(path("kept.png"), "mine");
  const Outcome refused = run(shot);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(text("kept.png"), "mine");
  EXPECT_NE(refused.err.find("kept.png: exists"), std::string::npos) << refused.err;
  // As isohf export: what is not a picture stays even then.
  EXPECT_EQ(run(shot + " --overwrite").exit_code, 2);
  EXPECT_EQ(text("kept.png"), "mine");
  EXPECT_EQ(std::remove(path("kept.png").c_str()), 0);
  EXPECT_EQ(run(shot).exit_code, 0);
  EXPECT_EQ(run(shot + " --overwrite").exit_code, 0);
  EXPECT_TRUE(is_png("kept.png"));
}

TEST_F(ViewProgramTest, RefusesWhatIsNeitherArchiveNorRaster) {
  const std::string shot = " --overwrite --size 64x48 --screenshot " + path("a.png");
  test::write_file(path("bare.r16"), std::string(80000, 'x'));
  EXPECT_EQ(run(path("bare.r16") + shot).exit_code, 2);
  test::write_file(path("notes.txt"), "no raster, no archive\n");
  const Outcome notes = run(path("notes.txt") + shot);
  EXPECT_EQ(notes.exit_code, 1);
  EXPECT_EQ(std::count(notes.err.begin(), notes.err.end(), '\n'), 1) << notes.err;
}

TEST_F(ViewProgramTest, ShowsARasterAndLeavesNothingBehind) {
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  const std::string folder = path("scratch");
  std::filesystem::create_directory(folder);
  const Outcome drawn = run(raster + " --size 64x48 --json --screenshot " + path("coast.png"), "TMPDIR=" + folder);
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_TRUE(is_png("coast.png"));
  EXPECT_NE(drawn.out.find("coast_512x384_int16.tif"), std::string::npos) << drawn.out;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  // Its map is understood later on all the same.
  const Outcome day =
      run(raster + " -q --size 64x48 --date 2026-06-21 --screenshot " + path("day.png"), "TMPDIR=" + folder);
  EXPECT_EQ(day.exit_code, 0) << day.err;
  const std::string bytes = test::read_file(raster);
  test::write_file(path("cut.tif"), bytes.substr(0, 3000));
  const Outcome cut = run(path("cut.tif") + " --size 64x48 --screenshot " + path("cut.png"), "TMPDIR=" + folder);
  EXPECT_EQ(cut.exit_code, 1);
  EXPECT_EQ(std::count(cut.err.begin(), cut.err.end(), '\n'), 1) << cut.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(ViewProgramTest, AKilledOneLeavesNothingOfARaster) {
  const std::string folder = path("scratch");
  std::filesystem::create_directory(folder);
  // The archive has lost its name once it is open.
  const test::RunResult killed =
      test::run_program({"/bin/sh", "-c",
                         "TMPDIR=\"$1\" '" ISOHF_BIN_DIR "/isohf-view' '" ISOHF_SOURCE_DIR
                         "/testdata/coast_512x384_int16.tif' -q --verify & viewer=$!\n"
                         "until ls -l /proc/$viewer/fd | grep -q 'isohf-view.*deleted' && [ -z \"$(ls \"$1\")\" ]; do\n"
                         "  kill -0 $viewer || exit 9; sleep 0.02; done\n"
                         "kill -KILL $viewer",
                         "sh", folder});
  EXPECT_EQ(killed.exit_code, 0) << killed.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(ViewProgramTest, WritesALegendOnPictures) {
  const std::string shot = path("good.isohf") + " --size 320x240 --overwrite --screenshot " + path("legend.png");
  EXPECT_EQ(run(shot).exit_code, 0);
  const std::string bare = text("legend.png");
  const Outcome written = run(shot + " --legend");
  EXPECT_EQ(written.exit_code, 0) << written.err;
  EXPECT_NE(text("legend.png"), bare);
}

TEST_F(ViewProgramTest, LeavesNothingInAFolderThatIsTooSmallForARaster) {
  const std::string folder = path("scratch");
  std::filesystem::create_directory(folder);
  test::RunOptions full;
  full.file_size_limit_bytes = 50000;
  const Outcome outcome = test::run_program({"/bin/sh", "-c",
                                             "TMPDIR=" + folder +
                                                 " '" ISOHF_BIN_DIR "/isohf-view' " ISOHF_SOURCE_DIR
                                                 "/testdata/coast_512x384_int16.tif --size 64x48 --screenshot " +
                                                 path("none.png")},
                                            full);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("TMPDIR names another folder"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("resume"), std::string::npos) << outcome.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(ViewProgramTest, ReadsItsPartOfAConfigFileForAllCommands) {
  test::write_file(
      path("all.toml"),
      "quiet = true\ndensity = 0.5\n[convert]\neffort = \"fast\"\n[view]\nsize = \"64x48\"\nquiet = false\n"
      "json = true\nposition = [480, 300, 900]\n");
  const Outcome drawn =
      run(path("good.isohf") + " --config " + path("all.toml") + " --screenshot " + path("config.png"));
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_NE(drawn.out.find("\"width\": 64"), std::string::npos) << drawn.out;
  test::write_file(path("wrong.toml"), "[view]\nsiez = \"64x48\"\n");
  const Outcome wrong = run(path("good.isohf") + " --config " + path("wrong.toml"));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("wrong.toml:2: view has no option 'siez'; did you mean --size?"), std::string::npos)
      << wrong.err;
}

TEST_F(ViewProgramTest, IsStartedByIsohfView) {
  const Outcome drawn =
      test::run_isohf({"view", path("good.isohf"), "--size", "64x48", "--screenshot", path("view.png"), "--json"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_TRUE(is_png("view.png"));
  EXPECT_EQ(test::run_isohf({"-q", "view", path("good.isohf"), "--verify"}).out, "");
}

/// What a hand does: 60 notches of the wheel at nine places, drags with every button, a flight, and then nothing.
TEST_F(ViewProgramTest, IsSteeredByMouseAndKeys) {
  if (!has_display()) GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  const auto end = in_window(path("good.isohf"), R"sh(
    for x in 20 160 300; do
      for y in 20 120 220; do
        xdotool key Home sleep 0.6 mousemove $x $y click --repeat 60 --delay 5 4 sleep 0.3
      done
    done
    for button in 1 2 3; do xdotool mousemove 160 120 mousedown $button mousemove 210 150 mousemove 120 90 mouseup $button; done
    xdotool mousemove 160 130 click --repeat 2 --delay 60 1 sleep 0.6
    xdotool keydown w keydown Shift_L sleep 1.5 keyup Shift_L keyup w
    sleep 1
    ticks() { cut -d' ' -f14,15 /proc/$viewer/stat | tr ' ' + ; }
    before=$(($(ticks))) && sleep 4 && echo $(($(ticks) - before)) >ticks
  )sh");
  EXPECT_GT(end.at("height_above_ground").get<double>(), 0.0) << end;
  EXPECT_GT(end.at("triangles").get<std::int64_t>(), 0) << end;
  EXPECT_LE(std::stoi(text("ticks")), 4)
      << "an idle window takes no more than 1 % of a processor: 100 ticks are a second";
}

/// Pictures with shadows, without, and with them again; then every other key.
TEST_F(ViewProgramTest, ObeysKeysInAWindow) {
  if (!has_display()) GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  in_window(path("good.isohf") + " --sun 90,6 --exaggeration 8", R"sh(
    picture() {
      xdotool key "$@"
      count=$((count + 1))
      for i in $(seq 200); do grep -q "isohf-000$count.png" window.err && return; sleep 0.1; done
    }
    xdotool sleep 3  # until there are shadows
    picture p
    picture u p
    picture u p
    picture k k k m m m m m x y Home r plus minus bracketleft bracketright f h h r j l i w a s d q e o o p
  )sh");
  const std::string lit = text("isohf-0001.png");
  EXPECT_TRUE(is_png("isohf-0001.png"));
  EXPECT_NE(lit, text("isohf-0002.png"));
  EXPECT_EQ(lit, text("isohf-0003.png"));
  EXPECT_TRUE(is_png("isohf-0004.png"));
}

/// Moving the cursor draws no ground; what is saved is drawn as pictures are; the sun goes back to where it stood before a
/// day.
TEST_F(ViewProgramTest, RestsWhileTheCursorMoves) {
  if (!has_display()) GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  const auto end = in_window(raster + " -q", R"sh(
    xdotool sleep 1 key p sleep 1
    for x in $(seq 60); do xdotool mousemove $((50 + x)) 120 sleep 0.03; done
    xdotool key o sleep 0.5 key o sleep 0.5
  )sh");
  EXPECT_LT(end.at("frames").get<int>(), 40) << end;
  EXPECT_NEAR(end.at("under_cursor").at("longitude").get<double>(), 12.4, 0.2) << end;
  EXPECT_EQ(end.at("sun_azimuth_deg").get<double>(), 300.0) << end;
  const Outcome drawn = run(raster + " -q --size 320x240 --screenshot " + path("drawn.png"));
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_EQ(text("isohf-0001.png"), text("drawn.png"));
}

/// The place under the cursor, before a drag and after it, is the same.
TEST_F(ViewProgramTest, ADragInTheWindowTakesTheGroundAlong) {
  if (!has_display()) GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  const auto under_cursor = [&](const std::string& drag) {
    return in_window(path("good.isohf") + " --position 480,900,1500 --look-at 480,0,400",
                     "xdotool mousemove 150 140 sleep 0.3 " + drag);
  };
  const auto before = under_cursor("");
  const auto after =
      under_cursor("mousedown 1 mousemove 170 150 sleep 0.1 mousemove 200 160 sleep 0.1 mouseup 1 sleep 0.3");
  EXPECT_NE(before.at("eye"), after.at("eye"));
  // Seen from 1200 units a pixel is 5 wide; two of them, slanted.
  for (const char* axis : {"x", "z"}) {
    EXPECT_NEAR(before.at("under_cursor").at(axis).get<double>(), after.at("under_cursor").at(axis).get<double>(),
                10.0);
  }
}

/// docs/schema/view.json lists what is printed, member by member.
TEST_F(ViewProgramTest, DocumentsAreWhatTheirSchemaSays) {
  if (std::system("python3 -c 'import jsonschema' >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "python3-jsonschema is not installed";
  }
  std::filesystem::create_directory(path("documents"));
  int number = 0;
  const auto keep = [&](const std::string& action, int exit_code) {
    const Outcome said = run(path("good.isohf") + " --json --size 64x48 " + action);
    EXPECT_EQ(said.exit_code, exit_code) << said.err;
    test::write_file(path("documents/") + (exit_code == 2 ? "error." : "view.") + std::to_string(++number) + ".json",
                     said.out);
  };
  keep("--screenshot " + path("a.png"), 0);
  keep("--verify", 0);
  keep("--legend --screenshot " + path("small.png"), 2);
  if (has_display()) {
    in_window(path("good.isohf"), "xdotool mousemove 160 120 sleep 0.3");
    std::filesystem::copy_file(path("window.json"), path("documents/view.window.json"));
  }
  const Outcome valid =
      test::run_program({"/usr/bin/env", "python3", "-B", ISOHF_SOURCE_DIR "/tests/cli/output/validate_documents.py",
                         ISOHF_SOURCE_DIR "/docs/schema", path("documents")});
  EXPECT_EQ(valid.exit_code, 0) << valid.out << valid.err;
}

/// Nor is a picture begun that nobody waits for any more.
TEST_F(ViewProgramTest, EndsWith130WhereItIsInterrupted) {
  test::write_analytic_archive(path("many.isohf"), TileGrid::make(TileShape::make(36, 43, 3), 40, 30, 320.0, 320.0));
  const std::pair<const char*, const char*> kCases[] = {
      {"INT", "--verify"},
      {"TERM", "--screenshot big.png --size 8192x8192"},
  };
  for (const std::string& what :
       {path("many.isohf"), std::string(ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif")}) {
    for (const auto& [signal, action] : kCases) {
      // Few tiles are verified before the signal comes.
      if (what != path("many.isohf") && std::string_view(action) == "--verify") continue;
      SCOPED_TRACE(what + " " + action);
      const Outcome stopped =
          test::run_program({"/bin/sh", "-c",
                             "cd '" + path("") + "' && timeout --preserve-status -s " + signal +
                                 " 1.5 '" ISOHF_BIN_DIR "/isohf-view' '" + what + "' -q " + action});
      // A fast machine has drawn the picture by then.
      const bool is_drawn = std::filesystem::exists(path("big.png"));
      EXPECT_EQ(stopped.exit_code, is_drawn ? 0 : 130) << stopped.err;
      std::filesystem::remove(path("big.png"));
    }
  }
}

/// In the window, which stays.
TEST_F(ViewProgramTest, APictureThatCannotBeKeptEndsNothing) {
  if (!has_display()) GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  in_window(path("good.isohf"), R"sh(
    xdotool key p
    for wait in $(seq 100); do grep -q isohf-0001 "$1/window.err" && break; sleep 0.1; done
  )sh",
            "/proc");
  EXPECT_NE(text("window.err").find("isohf-0001.png"), std::string::npos) << text("window.err");
  EXPECT_EQ(text("window.err").find("wrote"), std::string::npos) << text("window.err");
}

TEST_F(ViewProgramTest, SaysHowMuchMemoryWouldDo) {
  test::write_analytic_archive(path("large.isohf"), TileGrid::make(TileShape::make(212, 243, 4), 3, 3, 320.0, 320.0));
  const std::string shot = path("large.isohf") + " --size 64x48 --screenshot " + path("m.png") + " --memory ";
  const Outcome little = run(shot + "1M");
  EXPECT_EQ(little.exit_code, 2) << little.err;
  const std::size_t at = little.err.rfind("--memory ");
  ASSERT_NE(at, std::string::npos) << little.err;
  const Outcome enough = run(shot + std::to_string(std::stoi(little.err.substr(at + 9))) + "M");
  EXPECT_EQ(enough.exit_code, 0) << enough.err;
}

}  // namespace
}  // namespace isohf
