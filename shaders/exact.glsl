// Converts an integer below 2^23 to a float through the mantissa, which GPUs do faster than a conversion.
#ifndef VDI_EXACT_GLSL
#define VDI_EXACT_GLSL

float exactFloat(uint value) { return uintBitsToFloat(0x4b000000u | value) - 8388608.0; }

#endif
