#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

#include "io/column.h"
#include "io/cursor.h"
#include "io/particle_readers.h"
#include "io/text.h"
#include "io/unnamed_columns.h"

namespace embrun {

namespace {

enum class Separator : char { comma = ',', semicolon = ';', blanks = ' ' };

bool is_comment(std::string_view line) {
  return line.starts_with('#') || line.starts_with("//") || line.starts_with('%');
}

std::string_view without_comment_mark(std::string_view line) {
  while (!line.empty() && (line[0] == '#' || line[0] == '/' || line[0] == '%' || is_space(line[0])))
    line.remove_prefix(1);
  return line;
}

Separator separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return Separator::semicolon;
  return line.find(',') != std::string_view::npos ? Separator::comma : Separator::blanks;
}

/// Splits a line into fields. Double quotes keep separators together; they are taken off, "" inside them stands as is.
void split(std::string_view line, Separator separator, std::vector<std::string_view>& fields) {
  fields.clear();
  const auto ends_field = [&](char c) {
    return separator == Separator::blanks ? is_space(c) : c == static_cast<char>(separator);
  };
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && is_space(line[i])) ++i;
    if (separator == Separator::blanks && i == line.size()) return;
    const std::size_t begin = i;
    bool quoted_part = false;
    while (i < line.size() && (quoted_part || !ends_field(line[i]))) quoted_part ^= line[i++] == '"';
    std::string_view field = trimmed(line.substr(begin, i - begin));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trimmed(field.substr(1, field.size() - 2));
    fields.push_back(field);
    if (i == line.size()) return;
    ++i;
  }
}

/// A number in a file that may have decimal commas.
std::optional<double> parse_field(std::string_view field, Separator separator) {
  if (separator != Separator::semicolon || field.find(',') == std::string_view::npos) return parse_double(field);
  std::string with_point(field);
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  return parse_double(with_point);
}

/// A column while its rows come in: of integers until one is not, or of words.
class TableColumn {
 public:
  explicit TableColumn(std::string name) { column_.name = std::move(name); }

  /// False when the field is a word in a column of numbers, or one word too many.
  bool append(std::string_view field, Separator separator) {
    if (kind_ == Kind::words) return append_word(field);
    if (field.empty()) return append_missing();
    if (kind_ != Kind::numbers) {
      if (const auto integer = parse_int64(field)) {
        kind_ = Kind::integers;
        column_.longs.push_back(*integer);
        return true;
      }
    }
    if (const auto number = parse_field(field, separator)) {
      become_numbers();
      column_.doubles.push_back(*number);
      return true;
    }
    // Only a column that starts with words is one of words: a word further down is a damaged number.
    if (kind_ != Kind::unknown) return false;
    kind_ = Kind::words;
    for (std::size_t i = 0; i < missing_rows_.size(); ++i) append_word("");
    column_.longs.clear();
    return append_word(field);
  }

  const std::string& name() const { return column_.name; }
  bool has_numbers() const { return kind_ == Kind::integers || kind_ == Kind::numbers; }

  Column finish() && {
    if (kind_ == Kind::unknown) become_numbers();
    column_.type = kind_ == Kind::numbers    ? ScalarType::float64
                   : kind_ == Kind::integers ? ScalarType::int64
                                             : ScalarType::int32;
    if (kind_ == Kind::integers) column_.missing = missing_rows_.size();
    return std::move(column_);
  }

 private:
  enum class Kind { unknown, integers, numbers, words } kind_ = Kind::unknown;
  Column column_;
  std::vector<std::size_t> missing_rows_;  // of empty fields, while the column is not one of numbers or words
  std::unordered_map<std::string, std::int32_t> words_;

  bool append_missing() {
    if (kind_ == Kind::numbers) {
      column_.doubles.push_back(std::numeric_limits<double>::quiet_NaN());
    } else {
      missing_rows_.push_back(column_.longs.size());
      column_.longs.push_back(0);
    }
    return true;
  }

  void become_numbers() {
    if (kind_ == Kind::numbers) return;
    kind_ = Kind::numbers;
    column_.doubles.assign(column_.longs.begin(), column_.longs.end());
    for (const std::size_t row : missing_rows_) column_.doubles[row] = std::numeric_limits<double>::quiet_NaN();
    column_.longs = {};
    missing_rows_ = {};
  }

  bool append_word(std::string_view field) {
    // Far above any list of kinds; keeps a text file that is no table from filling memory with its words.
    constexpr std::size_t most_words = 1 << 20;
    const auto [entry, is_new] = words_.try_emplace(std::string(field), static_cast<std::int32_t>(words_.size()));
    if (is_new) column_.strings.emplace_back(field);
    column_.ints.push_back(entry->second);
    return words_.size() <= most_words;
  }
};

/// The next line that is neither empty nor a comment; empty at the end. `comment` gets the last comment before it.
std::string_view next_row(Cursor& cursor, std::string_view* comment = nullptr) {
  while (true) {
    const std::string_view line = cursor.filled_line();
    if (line.empty() || !is_comment(line)) return line;
    if (comment) *comment = line;
  }
}

class TableReader {
 public:
  TableReader(std::span<const std::byte> file, std::string_view name) : cursor_(file, name) {}

  ParticleSet read() {
    skip_byte_order_mark();
    read_names();
    const std::size_t rows = read_rows();
    std::vector<Column> columns = finish_columns();
    std::vector<std::string> notes;
    if (!named_) name_by_values(columns, notes);
    const Cursor start = first_row_;
    ParticleSet set = particles_from_columns(cursor_.file(), rows, std::move(columns), [start](std::size_t row) {
      Cursor cursor = start;
      for (std::size_t i = 0; i <= row; ++i) next_row(cursor);
      return cursor.place();
    });
    set.format = chemical_ ? "XYZ" : separator_ == Separator::blanks ? "text table" : "CSV";
    set.notes.insert(set.notes.end(), notes.begin(), notes.end());
    if (more_frames_) set.notes.push_back("only the first of several frames was read");
    return set;
  }

 private:
  Cursor cursor_;
  Cursor first_row_{{}, ""};  // at the first row of numbers
  Separator separator_ = Separator::blanks;
  std::vector<std::string_view> fields_;
  std::vector<TableColumn> columns_;
  bool named_ = false;           // by a header
  bool chemical_ = false;        // a count and a comment come first
  std::uint64_t announced_ = 0;  // rows, where chemical_
  bool more_frames_ = false;

  void skip_byte_order_mark() {
    Cursor ahead = cursor_;
    if (ahead.line().starts_with("\xef\xbb\xbf")) cursor_.take(3);
  }

  bool is_number(std::string_view field) const { return parse_field(field, separator_).has_value(); }

  void split_row(std::string_view line) {
    separator_ = separator_of(line);
    split(line, separator_, fields_);
  }

  void set_names(std::string_view header) {
    std::vector<std::string_view> names;
    split(header, separator_of(header), names);
    if (names.size() > 1 && names.back().empty()) names.pop_back();
    if (names.size() > max_columns) cursor_.fail("header", fmt::format("more than {} columns", max_columns));
    columns_.clear();
    for (const std::string_view name : names) columns_.emplace_back(std::string(name));
    named_ = true;
  }

  // Finds out what the columns are and leaves the cursor at the first row.
  void read_names() {
    std::string_view comment;
    first_row_ = cursor_;
    std::string_view line = next_row(cursor_, &comment);
    if (line.empty()) cursor_.fail("", no_particles);
    split_row(line);
    if (fields_.size() == 1 && parse_uint64(fields_[0])) {
      chemical_ = true;
      announced_ = *parse_uint64(fields_[0]);
      if (announced_ == 0) cursor_.fail("number of particles", no_particles);
      line = skip_title();
    } else if (std::none_of(fields_.begin(), fields_.end(), [&](auto field) { return is_number(field); })) {
      set_names(line);
      first_row_ = cursor_;
      line = next_row(cursor_);
      if (line.empty()) cursor_.fail("", no_particles);
      split_row(line);
    } else if (!comment.empty()) {
      use_comment_as_names(without_comment_mark(comment));
    }
    if (!named_) name_by_position();
    cursor_ = first_row_;
  }

  // The line after the count is a title, unless it is a row already; returns the first row.
  std::string_view skip_title() {
    first_row_ = cursor_;
    const std::string_view title = trimmed(cursor_.line());
    split_row(title);
    if (fields_.size() >= 3 && std::all_of(fields_.begin(), fields_.end(), [&](auto f) { return is_number(f); })) {
      return title;
    }
    first_row_ = cursor_;
    const std::string_view line = next_row(cursor_);
    if (line.empty()) cursor_.fail("number of particles", fmt::format("no rows after the announced {}", announced_));
    split_row(line);
    return line;
  }

  // "# x y z density": a header in a comment, if it has a name for each column.
  void use_comment_as_names(std::string_view comment) {
    std::vector<std::string_view> names;
    split(comment, separator_of(comment), names);
    const auto has = [&](std::string_view wanted) {
      return std::any_of(names.begin(), names.end(), [&](auto name) { return to_lower(name) == wanted; });
    };
    if (names.size() == fields_.size() && has("x") && has("y") && has("z")) set_names(comment);
  }

  // Without a header: the first three columns of numbers are the position.
  void name_by_position() {
    if (fields_.size() > max_columns) cursor_.fail("", fmt::format("more than {} columns", max_columns));
    constexpr std::string_view axes = "xyz";
    std::size_t axis = 0;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (axis < 3 && is_number(fields_[i])) {
        columns_.emplace_back(std::string(1, axes[axis++]));
      } else {
        columns_.emplace_back(chemical_ && i == 0 ? "element" : fmt::format("column_{}", i + 1));
      }
    }
    if (axis < 3) {
      cursor_.fail("position", fmt::format("{} numbers on the line where x, y and z are needed", axis));
    }
  }

  std::size_t read_rows() {
    std::size_t rows = 0;
    while (!chemical_ || rows < announced_) {
      const std::string_view line = next_row(cursor_);
      if (line.empty()) break;
      split(line, separator_, fields_);
      if (fields_.size() == columns_.size() + 1 && fields_.back().empty()) fields_.pop_back();
      if (fields_.size() != columns_.size()) {
        cursor_.fail("", fmt::format("{} values on the line, {} columns", fields_.size(), columns_.size()));
      }
      for (std::size_t i = 0; i < fields_.size(); ++i) {
        if (columns_[i].append(fields_[i], separator_)) continue;
        cursor_.fail("column " + quoted(columns_[i].name()), fmt::format("{} is not a number", quoted(fields_[i])));
      }
      ++rows;
    }
    if (chemical_) check_count(rows);
    return rows;
  }

  void check_count(std::size_t rows) {
    if (rows < announced_) {
      cursor_.fail("number of particles", fmt::format("{} are announced, {} are there", announced_, rows));
    }
    const std::string_view rest = next_row(cursor_);
    if (rest.empty()) return;
    if (!parse_uint64(rest)) {
      cursor_.fail("number of particles", fmt::format("{} are announced, but there are more", announced_));
    }
    more_frames_ = true;
  }

  std::vector<Column> finish_columns() {
    std::vector<Column> columns;
    for (TableColumn& column : columns_) columns.push_back(std::move(column).finish());
    return columns;
  }
};

}  // namespace

ParticleSet read_xyz(std::span<const std::byte> file, std::string_view name) { return TableReader(file, name).read(); }

}  // namespace embrun
