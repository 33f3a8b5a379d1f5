// Converts an integer below 2^23 by way of its mantissa, which is faster on a GPU than a conversion.
float exactFloat(uint value) { return uintBitsToFloat(0x4b000000u | value) - 8388608.0; }
