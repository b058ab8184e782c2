#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace embrun {

/// The middle value, of an even count the upper one. Reorders the values, of which there must be one.
template <class Value>
Value median_of(std::vector<Value>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace embrun
