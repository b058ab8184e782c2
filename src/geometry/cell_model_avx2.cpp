#define EMBRUN_CELL_MODEL cell_model_avx2
#include "geometry/cell_model_body.h"
