#pragma once

#include <string>

namespace isohf {

/// The path of the file called `name`, in any case, in the folder of the file `beside`: labels were written for file
/// systems without case. Empty where there is none.
[[nodiscard]] std::string file_beside(const std::string& beside, const std::string& name);

}  // namespace isohf
