#include "isohf/job.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "isohf/base/arena.h"
#include "isohf/error.h"

namespace isohf {
namespace {

TEST(Job, StopsOnceItIsCancelled) {
  EXPECT_NO_THROW(Job().throw_if_cancelled());
  std::atomic<bool> cancel = false;
  Job job;
  job.cancel = &cancel;
  EXPECT_NO_THROW(job.throw_if_cancelled());
  cancel = true;
  try {
    job.throw_if_cancelled();
    FAIL() << "went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(Job, ReportsToWhomItConcernsOnly) {
  EXPECT_NO_THROW(Job().report({"tiles", "tiles", 1, 2, 0}));
  Job job;
  std::string heard;
  job.progress = [&](const Progress& at) { heard = at.stage; };
  job.report({"tiles", "tiles", 1, 2, 0});
  EXPECT_EQ(heard, "tiles");
}

TEST(Arena, HasTheThreadsOfItsJob) {
  for (const int threads : {1, 3, 2 * oneapi::tbb::this_task_arena::max_concurrency()}) {
    Job job;
    job.threads = threads;
    EXPECT_EQ(threads_of(job), threads);
    int found = 0;
    Arena(job).execute([&] { found = oneapi::tbb::this_task_arena::max_concurrency(); });
    EXPECT_EQ(found, threads);
  }
}

TEST(Job, AQuarterOfTheMachineBoundsWhatNothingElseDoes) {
  Job job;
  EXPECT_EQ(job.bound_bytes(), 0U);
  job.machine_bytes = 4000;
  EXPECT_EQ(job.bound_bytes(), 1000U);
  job.memory_bytes = 3000;
  EXPECT_EQ(job.bound_bytes(), 3000U);
}

}  // namespace
}  // namespace isohf
