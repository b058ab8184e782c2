#include "reproduction/output.h"

#include <fmt/format.h>

#include <system_error>

#include "base/error.h"

namespace embrun {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder))
    throw Error(fmt::format("{}: cannot make this folder: {}", folder.string(),
                            error ? error.message() : "there is a file of that name"));
}

std::string table_row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line + "\n";
}
std::string table_head(const std::vector<std::string>& cells) {
  std::string line = table_row(cells) + "|";
  for (std::size_t i = 0; i < cells.size(); ++i) line += " --- |";
  return line + "\n";
}

}  // namespace embrun
