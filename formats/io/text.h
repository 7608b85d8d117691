#pragma once

#include "isohf/base/text.h"
