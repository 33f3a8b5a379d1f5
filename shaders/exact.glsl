// Converts an integer below 2^23 by way of its mantissa. On a GPU that is faster than a conversion.
#ifndef VDI_EXACT_GLSL
#define VDI_EXACT_GLSL

float exactFloat(uint value) { return uintBitsToFloat(0x4b000000u | value) - 8388608.0; }

#endif
