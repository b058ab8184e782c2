#include "io/scene/number_in_order.h"

#include <cstddef>
#include <utility>
#include <vector>

#include "scene/each_material.h"

namespace embrun {
namespace {

/// New numbers for the elements of an array, given in the order in which they are asked for.
class Order {
 public:
  explicit Order(std::size_t count) : numbers_(count, -1) {}

  void renumber(int& index) {
    if (index < 0) return;
    int& number = numbers_.at(static_cast<std::size_t>(index));
    if (number < 0) number = next_++;
    index = number;
  }
  template <class Element>
  void sort(std::vector<Element>& elements) const {
    std::vector<Element> sorted(static_cast<std::size_t>(next_));
    for (std::size_t i = 0; i < elements.size(); ++i)
      if (numbers_[i] >= 0) sorted[static_cast<std::size_t>(numbers_[i])] = std::move(elements[i]);
    elements = std::move(sorted);
  }

 private:
  std::vector<int> numbers_;
  int next_ = 0;
};

void renumber_pictures(MaterialDescription& material, Order& pictures) {
  pictures.renumber(material.reflectance.picture);
  pictures.renumber(material.roughness.picture);
  for (MaterialDescription& back : material.back) renumber_pictures(back, pictures);
}

}  // namespace

void number_in_order(SceneDescription& scene) {
  Order pictures(scene.pictures.size()), media(scene.grid_media.size());
  each_material(scene, [&](MaterialDescription& material, const char*, std::size_t) {
    renumber_pictures(material, pictures);
    media.renumber(material.grid_medium);
  });
  pictures.sort(scene.pictures);
  media.sort(scene.grid_media);
}

}  // namespace embrun
