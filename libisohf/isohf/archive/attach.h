#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace isohf {

/// A file that becomes a member of an archive.
struct Attachment {
  std::string path;
  std::string name;  ///< of the member
};

/// Adds files to an archive of version 2 as members of their own, deflated where that makes them smaller; members that
/// other tools added behind the index come along. The archive is copied to NAME.part, which takes its name when it is
/// complete: whenever it is interrupted, the archive is as it was or has all of them. Returns its new size.
/// Throws Error{kInvalidArgument}: a name that is not allowed or taken; an archive of version 1 or that other tools have
/// repacked. Otherwise what reading and writing throw. Memory: the largest of the files.
[[nodiscard]] std::uint64_t attach_members(const std::string& archive, const std::vector<Attachment>& files);

}  // namespace isohf
