#include "measure/flight_path.h"

#include <gtest/gtest.h>

#include "isohf/error.h"
#include "support/temporary_folder.h"

namespace isohf::view {
namespace {

FlightPath read(const std::string& text) {
  const test::TemporaryFolder folder;
  test::write_file(folder / "path.txt", text);
  return FlightPath::read(folder / "path.txt");
}

TEST(FlightPath, PassesThroughItsPlaces) {
  const FlightPath path = read("0 1 2 3 4 5 6\n\n# half way\n1 2 2 3 4 5 7\r\n3 9 2 3 4 5 8 # end\n");
  EXPECT_EQ(path.begin_s(), 0.0);
  EXPECT_EQ(path.end_s(), 3.0);
  EXPECT_EQ(path.at(0.0).eye, (Vec3{1, 2, 3}));
  EXPECT_EQ(path.at(1.0).target, (Vec3{4, 5, 7}));
  EXPECT_EQ(path.at(3.0).eye, (Vec3{9, 2, 3}));
  EXPECT_EQ(path.at(99.0).eye, (Vec3{9, 2, 3}));
  // No jump where two curves meet.
  EXPECT_NEAR(path.at(1.0 - 1e-9).eye.x, path.at(1.0 + 1e-9).eye.x, 1e-6);
}

TEST(FlightPath, RefusesWhatIsNoFlight) {
  EXPECT_THROW(FlightPath::read("/nowhere/flight.txt"), Error);
  EXPECT_THROW(read(""), Error);
  EXPECT_THROW(read("0 1 2 3 4 5 6\n"), Error);
  EXPECT_THROW(read("0 1 2 3 4 5 6\n0 1 2 3 4 5 6\n"), Error);
  EXPECT_THROW(read("0 1 2 3 4 5\n1 1 2 3 4 5 6\n"), Error);
  EXPECT_THROW(read("0 1 2 3 4 5 6 7\n1 1 2 3 4 5 6\n"), Error);
}

}  // namespace
}  // namespace isohf::view
