#include "media/media_state.h"

#include <gtest/gtest.h>

namespace embrun {
namespace {

constexpr MediaBoundary into(int media_class, int fluid = -1) { return {media_class, fluid, true}; }
constexpr MediaBoundary out_of(int media_class, int fluid = -1) { return {media_class, fluid, false}; }

TEST(MediaState, StartsInAir) {
  const MediaState state;
  EXPECT_EQ(state.current(), 0);
  for (int c = 0; c < max_media_classes; ++c) EXPECT_EQ(state.count(c), 0);
}

TEST(MediaState, TheHighestClassCountsWhateverTheOrder) {
  MediaState state = cross_boundary({}, into(2));
  EXPECT_EQ(state.current(), 2);
  state = cross_boundary(state, into(1));
  EXPECT_EQ(state.current(), 2);
  state = cross_boundary(state, into(7));
  EXPECT_EQ(state.current(), 7);
  state = cross_boundary(state, out_of(2));
  EXPECT_EQ(state.current(), 7);
  state = cross_boundary(state, out_of(7));
  EXPECT_EQ(state.current(), 1);
  state = cross_boundary(state, out_of(1));
  EXPECT_EQ(state, MediaState{});
}

TEST(MediaState, BodiesOfOneClassAreCounted) {
  MediaState state;
  for (int i = 0; i < max_crossings; ++i) {
    EXPECT_FALSE(contradicts(state, into(3)));
    state = cross_boundary(state, into(3));
  }
  EXPECT_EQ(state.count(3), max_crossings);
  EXPECT_EQ(state.count(4), 0);  // no carry
  EXPECT_TRUE(contradicts(state, into(3)));
  for (int i = 0; i < max_crossings; ++i) state = cross_boundary(state, out_of(3));
  EXPECT_EQ(state, MediaState{});
}

TEST(MediaState, FluidsKnowTheirSide) {
  MediaState state = cross_boundary({}, into(1, 5));
  EXPECT_TRUE(state.inside_fluid(5));
  EXPECT_FALSE(state.inside_fluid(4));
  state = cross_boundary(state, into(1, 31));
  EXPECT_TRUE(state.inside_fluid(31));
  EXPECT_EQ(state.count(1), 2);
  state = cross_boundary(state, out_of(1, 5));
  EXPECT_FALSE(state.inside_fluid(5));
  EXPECT_EQ(state.current(), 1);
}

TEST(MediaState, FindsContradictions) {
  EXPECT_TRUE(contradicts({}, out_of(1)));
  EXPECT_TRUE(contradicts({}, out_of(1, 0)));
  EXPECT_FALSE(contradicts({}, into(1, 0)));
  const MediaState in_fluid = cross_boundary({}, into(1, 0));
  EXPECT_TRUE(contradicts(in_fluid, into(1, 0)));  // one fluid is one solid
  EXPECT_FALSE(contradicts(in_fluid, into(1, 1)));
  EXPECT_FALSE(contradicts(in_fluid, into(1)));  // a ball of the same medium
  EXPECT_TRUE(contradicts(in_fluid, out_of(1, 1)));
  EXPECT_FALSE(contradicts(in_fluid, out_of(1, 0)));
}

TEST(MediaState, ReconcilingEndsTheContradiction) {
  const MediaState states[] = {{},
                               cross_boundary({}, into(1, 0)),
                               cross_boundary(cross_boundary({}, into(1)), into(2, 1)),
                               cross_boundary({}, into(1, 1))};
  const MediaBoundary boundaries[] = {into(1), out_of(1), into(1, 0), out_of(1, 0), into(2, 1), out_of(2, 1)};
  for (const MediaState& state : states)
    for (const MediaBoundary& boundary : boundaries) {
      const MediaState agreed = reconcile(state, boundary);
      EXPECT_FALSE(contradicts(agreed, boundary));
      if (!contradicts(state, boundary)) {
        EXPECT_EQ(agreed, state);
      }
      // And back again is where it came from.
      MediaBoundary back = boundary;
      back.entering = !back.entering;
      EXPECT_EQ(cross_boundary(cross_boundary(agreed, boundary), back), agreed);
    }
}

}  // namespace
}  // namespace embrun
