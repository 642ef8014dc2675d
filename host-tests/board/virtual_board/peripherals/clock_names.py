"""Bit positions of the clock gates and peripheral resets of the RCC (RM0090 section 7.3.5 to 7.3.19, STM32F405)."""

_AHB1 = {**{bit: f"GPIO{letter}" for bit, letter in enumerate("ABCDEFGHI")}, 12: "CRC", 18: "BKPSRAM", 20: "CCMDATARAM",
         21: "DMA1", 22: "DMA2", 29: "OTGHS", 30: "OTGHSULPI"}
_AHB2 = {0: "DCMI", 6: "RNG", 7: "OTGFS"}
_AHB3 = {0: "FSMC"}
_APB1 = {0: "TIM2", 1: "TIM3", 2: "TIM4", 3: "TIM5", 4: "TIM6", 5: "TIM7", 6: "TIM12", 7: "TIM13", 8: "TIM14", 11: "WWDG",
         14: "SPI2", 15: "SPI3", 17: "USART2", 18: "USART3", 19: "UART4", 20: "UART5", 21: "I2C1", 22: "I2C2", 23: "I2C3",
         25: "CAN1", 26: "CAN2", 28: "PWR", 29: "DAC"}
_APB2 = {0: "TIM1", 1: "TIM8", 4: "USART1", 5: "USART6", 8: "ADC1", 9: "ADC2", 10: "ADC3", 11: "SDIO", 12: "SPI1",
         14: "SYSCFG", 16: "TIM9", 17: "TIM10", 18: "TIM11"}
_NO_RESET = {"BKPSRAM", "CCMDATARAM", "OTGHSULPI", "ADC2", "ADC3"}


def _resets(names):
    return {bit: ("ADC1", "ADC2", "ADC3") if name == "ADC1" else (name,)
            for bit, name in names.items() if name not in _NO_RESET}


#: Enable registers by offset, each a map from bit to gate.
ENABLE = {0x30: _AHB1, 0x34: _AHB2, 0x38: _AHB3, 0x40: _APB1, 0x44: _APB2}
#: Reset registers by offset, each a map from bit to the peripherals that it resets.
RESET = {0x10: _resets(_AHB1), 0x14: _resets(_AHB2), 0x18: _resets(_AHB3), 0x20: _resets(_APB1), 0x24: _resets(_APB2)}
#: Reset values of the enable and reset registers.
RESET_VALUES = {**dict.fromkeys((*RESET, *ENABLE), 0), 0x30: 0x0010_0000}
