#pragma once

namespace isohf {

/// A vector (vector_size) that may lie at any address.
template <typename Vector>
struct [[gnu::packed, gnu::may_alias]] Unaligned {
  Vector value;
};

/// The elements of an array from `place` on as one vector, wherever they lie: `unaligned<Ints>(samples + 3).value`.
/// An alias of the vector type with aligned(4) says the same to GCC, but clang may take it for aligned all the same.
template <typename Vector>
[[gnu::always_inline]] inline const Unaligned<Vector>& unaligned(const void* place) {
  return *static_cast<const Unaligned<Vector>*>(place);
}
template <typename Vector>
[[gnu::always_inline]] inline Unaligned<Vector>& unaligned(void* place) {
  return *static_cast<Unaligned<Vector>*>(place);
}

}  // namespace isohf
