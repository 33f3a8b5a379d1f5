// Of an integer below 2^23: as its mantissa, which takes a GPU less time than a conversion.
float exactFloat(uint value) { return uintBitsToFloat(0x4b000000u | value) - 8388608.0; }
