#define EMBRUN_FIELD_SUMS field_sums_avx2
#include "geometry/field_sums_body.h"
