# Writes the words of the SPIR-V file INPUT to OUTPUT, as a C++ array spirv_NAME.
file(READ "${INPUT}" hex HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1,\n" words "${hex}")
file(WRITE "${OUTPUT}" "inline constexpr std::uint32_t spirv_${NAME}[] = {\n${words}};\n")
