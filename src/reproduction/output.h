#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace embrun {

/// Makes the folder that a reproduction is written to, if it is not there. Throws Error when it cannot.
void make_folder(const std::filesystem::path& folder);

/// A row of a Markdown table, and one that is its head.
std::string table_row(const std::vector<std::string>& cells);
std::string table_head(const std::vector<std::string>& cells);

}  // namespace embrun
