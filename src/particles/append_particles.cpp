#include "particles/append_particles.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

namespace embrun {
namespace {

void to_type(Attribute& attribute, AttributeType type) {
  if (attribute.type == type) return;
  Attribute converted = attribute;
  converted.type = type;
  converted.ints.clear();
  converted.longs.clear();
  for (std::size_t i = 0; i < attribute.value_count(); ++i) {
    if (type == AttributeType::float32)
      converted.floats.push_back(static_cast<float>(attribute.value(i)));
    else
      converted.longs.push_back(attribute.ints[i]);
  }
  attribute = std::move(converted);
}

/// Texts are looked up in the table of the first.
void share_texts(const Attribute& first, Attribute& second, std::vector<std::string>& table) {
  table = first.strings;
  std::vector<std::int32_t> numbers;
  for (const std::string& text : second.strings) {
    const auto known = std::find(table.begin(), table.end(), text);
    numbers.push_back(static_cast<std::int32_t>(known - table.begin()));
    if (known == table.end()) table.push_back(text);
  }
  for (std::int32_t& v : second.ints)
    v = v >= 0 && static_cast<std::size_t>(v) < numbers.size() ? numbers[static_cast<std::size_t>(v)] : -1;
}

template <class Value>
void append(std::vector<Value>& values, const std::vector<Value>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

/// False where the two are not of the same kind.
bool append_values(Attribute& first, Attribute& second) {
  if (first.components != second.components || first.strings.empty() != second.strings.empty()) return false;
  if (!first.strings.empty()) {
    std::vector<std::string> table;
    share_texts(first, second, table);
    first.strings = std::move(table);
  }
  if (first.type != second.type) {
    const bool floats = first.type == AttributeType::float32 || second.type == AttributeType::float32;
    const AttributeType type = floats ? AttributeType::float32 : AttributeType::int64;
    to_type(first, type);
    to_type(second, type);
  }
  append(first.floats, second.floats);
  append(first.ints, second.ints);
  append(first.longs, second.longs);
  first.replaced_non_finite += second.replaced_non_finite;
  return true;
}

void note(ParticleSet& set, std::string text) {
  if (std::find(set.notes.begin(), set.notes.end(), text) == set.notes.end()) set.notes.push_back(std::move(text));
}

}  // namespace

void append_particles(ParticleSet& set, ParticleSet more) {
  const auto named = [](ParticleSet& owner, const std::string& name) {
    return std::find_if(owner.attributes.begin(), owner.attributes.end(),
                        [&](const Attribute& a) { return a.name == name; });
  };
  for (const Attribute& attribute : more.attributes)
    if (named(set, attribute.name) == set.attributes.end())
      note(set, "the attribute \"" + attribute.name + "\" is not in all of the files; it is left out");
  std::erase_if(set.attributes, [&](Attribute& attribute) {
    const auto other = named(more, attribute.name);
    if (other != more.attributes.end() && append_values(attribute, *other)) return false;
    note(set, "the attribute \"" + attribute.name + "\" is not in all of the files; it is left out");
    return true;
  });
  append(set.positions, more.positions);
  set.dropped_non_finite += more.dropped_non_finite;
  for (std::string& text : more.notes) note(set, std::move(text));
}

}  // namespace embrun
