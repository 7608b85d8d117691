#include "isohf/convert/batch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace isohf::test {
namespace {

Job threads(int count) {
  Job job;
  job.threads = count;
  return job;
}

TEST(Batch, ReportsEveryTaskOnceAndInOrder) {
  for (const int workers : {1, 2, 7}) {
    std::vector<std::size_t> reported;
    Batch batch;
    batch.count = 100;
    batch.is_small = [](std::size_t number) { return number % 9 != 0; };
    batch.run = [](std::size_t, const Batch::Share&) { return Batch::Outcome::kDone; };
    batch.report = [&](std::size_t number) { reported.push_back(number); };
    run_batch(batch, threads(workers));
    ASSERT_EQ(reported.size(), batch.count);
    for (std::size_t i = 0; i < reported.size(); ++i) EXPECT_EQ(reported[i], i);
  }
}

TEST(Batch, RunsWhatIsTooLargeAloneWithAllThreads) {
  std::atomic<int> inside = 0;
  std::atomic<int> alone = 0;
  Batch batch;
  batch.count = 60;
  batch.is_small = [](std::size_t number) { return number % 10 != 3; };
  batch.run = [&](std::size_t number, const Batch::Share& share) {
    const int others = inside++;
    EXPECT_EQ(share.job.threads, share.is_whole ? 4 : 1);
    EXPECT_TRUE(others == 0 || !share.is_whole);
    alone += share.is_whole ? 1 : 0;
    --inside;
    return number % 10 == 7 && !share.is_whole ? Batch::Outcome::kTooLarge : Batch::Outcome::kDone;
  };
  batch.report = [](std::size_t) {};
  run_batch(batch, threads(4));
  EXPECT_EQ(alone, 12);
}

TEST(Batch, SharesTheMemory) {
  Batch batch;
  batch.count = 20;
  batch.is_small = [](std::size_t) { return true; };
  batch.run = [](std::size_t, const Batch::Share& share) {
    EXPECT_EQ(share.job.memory_bytes, 50'000'000U);  // of 100 MB, for two: a share is at least 48 MB
    return Batch::Outcome::kDone;
  };
  batch.report = [](std::size_t) {};
  Job job = threads(8);
  job.memory_bytes = 100'000'000;
  run_batch(batch, job);
}

TEST(Batch, StopsWhereATaskSaysSoAndThrowsWhatATaskThrows) {
  std::vector<std::size_t> reported;
  Batch batch;
  batch.count = 50;
  batch.is_small = [](std::size_t) { return true; };
  batch.run = [](std::size_t number, const Batch::Share&) {
    return number == 5 ? Batch::Outcome::kStop : Batch::Outcome::kDone;
  };
  batch.report = [&](std::size_t number) { reported.push_back(number); };
  run_batch(batch, threads(1));
  EXPECT_EQ(reported.size(), 6U);
  batch.run = [](std::size_t number, const Batch::Share&) -> Batch::Outcome {
    if (number == 3) throw std::runtime_error("three");
    return Batch::Outcome::kDone;
  };
  EXPECT_THROW(run_batch(batch, threads(3)), std::runtime_error);
}

}  // namespace
}  // namespace isohf::test
