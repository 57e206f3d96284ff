-- LinkRunCCA behind the pixel port that scripts/rivals.py describes.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

use work.sheet.all;
use work.vhdl_linkruncca_pkg.all;

entity top is
    port(
        clk: in std_logic;
        rst: in std_logic;
        pressed: in std_logic;
        x: in std_logic_vector(x_bits - 1 downto 0);
        y: in std_logic_vector(y_bits - 1 downto 0);
        found: out std_logic;
        zone: out std_logic_vector(area_bits + sum_x_bits + sum_y_bits - 1 downto 0)
    );
end;

architecture port_only of top is
    signal pixel: linkruncca_collect_t;
    signal feature: linkruncca_feature_t;
begin
    pixel.in_label <= pressed;
    pixel.x <= unsigned(x);
    pixel.y <= unsigned(y);
    zone <= std_logic_vector(feature.sum_y) & std_logic_vector(feature.sum_x) & std_logic_vector(feature.area);

    labeller: entity work.vhdl_linkruncca
        generic map(
            imwidth => width,
            imheight => height
        )
        port map(
            clk => clk,
            rst => rst,
            datavalid => '1',
            pix_in => pixel,
            res_valid_out => found,
            res_data_out => feature
        );
end;
