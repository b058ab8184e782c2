#pragma once

#include <string>
#include <vector>

#include "io/column.h"

namespace embrun {

/// Gives names to columns of a table without a header, where their values leave little doubt, and notes it:
/// three in a row of whole numbers from 0 to 255, not all below 2, are a colour (XYZRGB); three in a row of real numbers
/// that are vectors of unit length in every row (to 1 %; zeros are allowed) are a normal. One column between the position
/// and the colour, as in PTS files, is the intensity. Columns that have other names than column_N are left alone.
void name_by_values(std::vector<Column>& columns, std::vector<std::string>& notes);

}  // namespace embrun
