//! Which interrupts the drivers have.

use embassy_stm32::{adc, bind_interrupts, dma, peripherals, usart};

bind_interrupts!(pub struct Interrupts {
    ADC1_2 => adc::InterruptHandler<peripherals::ADC1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
    DMA1_CHANNEL3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_CHANNEL4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA1_CHANNEL5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>;
});
