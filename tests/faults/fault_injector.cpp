/// Preloaded (LD_PRELOAD) into a program, makes one of its system calls fail.
///
/// ISOHF_FAULT is "CALL ERROR N": the N-th call of that name fails with that number; with N followed by + every later
/// one does too. ISOHF_FAULT_COUNTS names a file that gets a line "CALL COUNT" for each at the end. Counted are calls
/// on files of the program's own: neither those of the system's folders nor standard error.

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

extern "C" void* __libc_malloc(std::size_t bytes);
extern "C" void* __libc_realloc(void* old, std::size_t bytes);

namespace {

enum Call { kOpen, kRead, kWrite, kFsync, kRename, kFlock, kTruncate, kAllocate, kClose, kThread, kMemory, kCalls };
constexpr std::array<const char*, kCalls> kNames = {"open",   "pread",          "write",     "fsync",
                                                    "rename", "flock",          "ftruncate", "posix_fallocate",
                                                    "close",  "pthread_create", "malloc"};

std::array<std::atomic<long>, kCalls> counts;
int failing = -1;
int error_number = 0;
long first = 0;
bool lasting = false;
bool ready = false;

/// Files that were opened by the program itself.
std::array<std::atomic<bool>, 1024> ours;

bool is_ours(int file) {
  return file == STDOUT_FILENO ||
         (file >= 0 && file < static_cast<int>(ours.size()) && ours[static_cast<std::size_t>(file)]);
}
void set_ours(int file, bool value) {
  if (file >= 0 && file < static_cast<int>(ours.size())) ours[static_cast<std::size_t>(file)] = value;
}

/// Counts a call; true where it is to fail, with errno set.
bool fails(Call call) {
  if (!ready) return false;
  const long number = ++counts[call];
  if (call != failing || number < first || (number > first && !lasting)) return false;
  errno = error_number;
  return true;
}

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool is_system_path(const char* path) {
  for (const char* start : {"/proc", "/sys", "/dev", "/usr", "/etc", "/lib"}) {
    if (std::strncmp(path, start, std::strlen(start)) == 0) return true;
  }
  return false;
}

int opened(int file) {
  set_ours(file, true);
  return file;
}

__attribute__((constructor)) void prepare() {
  if (const char* fault = std::getenv("ISOHF_FAULT"); fault != nullptr) {
    std::array<char, 32> name{};
    char plus = 0;
    std::sscanf(fault, "%31s %d %ld%c", name.data(), &error_number, &first, &plus);
    lasting = plus == '+';
    for (int call = 0; call < kCalls; ++call) {
      if (std::strcmp(kNames[static_cast<std::size_t>(call)], name.data()) == 0) failing = call;
    }
  }
  ready = true;
}

__attribute__((destructor)) void tell_counts() {
  ready = false;
  const char* path = std::getenv("ISOHF_FAULT_COUNTS");
  std::FILE* file = path == nullptr ? nullptr : std::fopen(path, "w");
  if (file == nullptr) return;
  for (std::size_t call = 0; call < kCalls; ++call) std::fprintf(file, "%s %ld\n", kNames[call], counts[call].load());
  std::fclose(file);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static auto* const real = next<int(const char*, int, ...)>("open");
  if (is_system_path(path)) return real(path, flags, mode);
  return fails(kOpen) ? -1 : opened(real(path, flags, mode));
}

int mkostemp(char* name, int flags) {
  static auto* const real = next<int(char*, int)>("mkostemp");
  return fails(kOpen) ? -1 : opened(real(name, flags));
}

std::FILE* fopen(const char* path, const char* mode) {
  static auto* const real = next<std::FILE*(const char*, const char*)>("fopen");
  return !is_system_path(path) && fails(kOpen) ? nullptr : real(path, mode);
}

int close(int file) {
  static auto* const real = next<int(int)>("close");
  const bool counted = file != STDOUT_FILENO && is_ours(file);
  set_ours(file, false);
  const int result = real(file);
  return counted && fails(kClose) ? -1 : result;  // the number is free in any case
}

ssize_t pread(int file, void* bytes, std::size_t count, off_t offset) {
  static auto* const real = next<ssize_t(int, void*, std::size_t, off_t)>("pread");
  return is_ours(file) && fails(kRead) ? -1 : real(file, bytes, count, offset);
}

ssize_t read(int file, void* bytes, std::size_t count) {
  static auto* const real = next<ssize_t(int, void*, std::size_t)>("read");
  return is_ours(file) && fails(kRead) ? -1 : real(file, bytes, count);
}

ssize_t write(int file, const void* bytes, std::size_t count) {
  static auto* const real = next<ssize_t(int, const void*, std::size_t)>("write");
  return is_ours(file) && fails(kWrite) ? -1 : real(file, bytes, count);
}

ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset) {
  static auto* const real = next<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  return is_ours(file) && fails(kWrite) ? -1 : real(file, bytes, count, offset);
}

int fsync(int file) {
  static auto* const real = next<int(int)>("fsync");
  return fails(kFsync) ? -1 : real(file);
}

int rename(const char* from, const char* to) noexcept {
  static auto* const real = next<int(const char*, const char*)>("rename");
  return fails(kRename) ? -1 : real(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  static auto* const real = next<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return fails(kRename) ? -1 : real(from_folder, from, to_folder, to, flags);
}

int flock(int file, int operation) noexcept {
  static auto* const real = next<int(int, int)>("flock");
  return fails(kFlock) ? -1 : real(file, operation);
}

int ftruncate(int file, off_t size) noexcept {
  static auto* const real = next<int(int, off_t)>("ftruncate");
  return fails(kTruncate) ? -1 : real(file, size);
}

int posix_fallocate(int file, off_t offset, off_t size) {
  static auto* const real = next<int(int, off_t, off_t)>("posix_fallocate");
  return fails(kAllocate) ? error_number : real(file, offset, size);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument) {
  static auto* const real = next<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
  return fails(kThread) ? error_number : real(thread, attributes, start, argument);
}

void* malloc(std::size_t bytes) {
  return fails(kMemory) ? nullptr : __libc_malloc(bytes);
}

void* realloc(void* old, std::size_t bytes) {
  return fails(kMemory) ? nullptr : __libc_realloc(old, bytes);
}

}  // extern "C"
