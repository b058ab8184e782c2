#define EMBRUN_FIELD_SUMS field_sums_baseline
#include "geometry/field_sums_body.h"
