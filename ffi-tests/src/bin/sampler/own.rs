//! Products of the renderer's header, through raw calls: what a client in C pays.

use std::ptr::null_mut;
use wis_ffi_tests::client::{Block, Result, check, raw};
use wis_ffi_tests::environment::{self, Environment};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::scene::ShadingPoint;

/// A light, a material, a sampler, and room for a product.
pub struct Own {
    environment: Environment,
    material: raw::wis_material,
    config: raw::wis_product_config,
    sampler: Block,
    product: Block,
    drawn: Vec<raw::wis_drawn>,
}

impl Own {
    pub fn new(light: &Light, material: &Material) -> Result<Own> {
        let sampler = raw::wis_sampler_config {
            size: size_of::<raw::wis_sampler_config>() as u32,
            cpu_level: raw::WIS_CPU_DETECT,
            ..Default::default()
        };
        let config =
            raw::wis_product_config { size: size_of::<raw::wis_product_config>() as u32, ..Default::default() };
        let (mut size, mut most, mut handle) =
            (raw::wis_memory_size::default(), raw::wis_memory_size::default(), null_mut());
        // SAFETY: every pointer is to a live local.
        check(unsafe { raw::wis_sampler_size(&sampler, &mut size, null_mut()) })?;
        // SAFETY: as above.
        check(unsafe { raw::wis_product_size(&config, &mut most, null_mut()) })?;
        let mut memory = Block::new(size.bytes);
        // SAFETY: the block is as long as it says.
        check(unsafe { raw::wis_sampler_init(&sampler, memory.start_mut(), memory.bytes(), &mut handle, null_mut()) })?;
        Ok(Own {
            environment: light.tables(0, 0.0)?,
            material: environment::material(&material.lobes())?,
            config,
            sampler: memory,
            product: Block::new(most.bytes),
            drawn: vec![raw::wis_drawn { wi: [0.0; 3], pdf: 0.0 }; 64],
        })
    }

    /// Prepares the product at a point; answers its bytes.
    pub fn prepare(&mut self, material: &Material, point: &ShadingPoint) -> Result<usize> {
        let point = material.point(point, &self.material);
        let (mut offset, mut used) = (0, 0);
        // SAFETY: handles and material are alive, and there is room for a product.
        check(unsafe {
            raw::wis_product_prepare(
                self.sampler.start_mut().cast(),
                self.environment.handle(),
                &self.config,
                1,
                &point,
                self.product.start_mut(),
                self.product.bytes(),
                &mut offset,
                &mut used,
            )
        })?;
        Ok(used)
    }

    /// The integral that it states.
    pub fn integral(&self) -> Result<f64> {
        let mut info = raw::wis_product_info { size: size_of::<raw::wis_product_info>() as u32, ..Default::default() };
        // SAFETY: environment and product are alive, and `info` is a live local.
        check(unsafe { raw::wis_product_describe(self.environment.handle(), self.product.start().cast(), &mut info) })?;
        Ok(info.integral)
    }

    /// Draws up to 64 directions from it.
    pub fn sample(&mut self, u: &[[f32; 2]]) -> Result<&[raw::wis_drawn]> {
        assert!(u.len() <= self.drawn.len());
        // SAFETY: environment and product are alive, and there is room for the directions.
        check(unsafe {
            raw::wis_sample(
                self.sampler.start_mut().cast(),
                self.environment.handle(),
                self.product.start().cast(),
                u.len(),
                u.as_ptr().cast(),
                0,
                self.drawn.as_mut_ptr(),
                0,
            )
        })?;
        Ok(&self.drawn[..u.len()])
    }

    /// The pdfs of directions.
    pub fn pdf(&mut self, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        assert!(wi.len() == pdf.len());
        // SAFETY: environment and product are alive, and the arrays are of one length.
        check(unsafe {
            let sampler = self.sampler.start_mut().cast();
            let (environment, product) = (self.environment.handle(), self.product.start().cast());
            raw::wis_pdf(sampler, environment, product, wi.len(), wi.as_ptr().cast(), 0, pdf.as_mut_ptr(), 0)
        })
    }
}
